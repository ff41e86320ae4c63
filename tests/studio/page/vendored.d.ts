// What the page uses of the libraries that it brings with it.
declare module "@preact/signals" {
  export interface Signal<T> {
    value: T;
    peek(): T;
  }
  export interface Computed<T> {
    readonly value: T;
    peek(): T;
  }
  export function signal<T>(value: T): Signal<T>;
  export function computed<T>(compute: () => T): Computed<T>;
  export function effect(run: () => void | (() => void)): () => void;
  export function batch<T>(run: () => T): T;
  export function untracked<T>(run: () => T): T;
  export function useSignal<T>(value: T): Signal<T>;
  export function useComputed<T>(compute: () => T): Computed<T>;
  export function useSignalEffect(run: () => void | (() => void)): void;
}
declare module "preact" {
  export function h(type: unknown, props: object | null, ...children: unknown[]): object;
  export function render(what: unknown, parent: Element): void;
}
declare module "preact/hooks" {
  export function useEffect(run: () => void | (() => void), inputs?: unknown[]): void;
  export function useErrorBoundary(): [any, () => void];
  export function useLayoutEffect(run: () => void | (() => void), inputs?: unknown[]): void;
  export function useRef<T>(value: T): { current: T };
  export function useState<T>(value: T | (() => T)): [T, (value: T | ((before: T) => T)) => void];
  export function useMemo<T>(make: () => T, inputs: unknown[]): T;
}
declare module "htm" {
  const htm: { bind<T>(h: T): (strings: TemplateStringsArray, ...values: unknown[]) => object };
  export default htm;
}
declare module "dagre" {
  export class Graph {
    constructor(how?: object);
    setGraph(how: object): void;
    setDefaultEdgeLabel(make: () => object): void;
    setNode(name: string, label: object): void;
    setEdge(from: string, to: string, label: object, name?: string): void;
    node(name: string): { x: number; y: number; width: number; height: number };
    edge(from: string, to: string, name?: string): { x: number; y: number; points: { x: number; y: number }[] };
    graph(): { width: number; height: number };
  }
  export function layout(graph: Graph): void;
}
