// What a hand or a key takes hold of: a target of 24 px over every joint and free point, in the order of the plan.

import { place } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { stated } from "../web/format.js";
import { TARGET } from "./drawing.js";
import { gridStep } from "./geometry.js";

const NOUNS = { joints: "Joint", points: "Point", centres: "Mass centre of" };
const MOST = 400; // targets; of larger mechanisms the list under Properties chooses
const FEW = 60; // that are put at every picture; to move more takes longer than a picture has, and they follow
const REST = 150; // ms after which they do

/** Put targets over the spots; `chosen` {kind, name} is marked. */
export function poseHandles(view, spots, chosen) {
  const few = spots.slice(0, MOST);
  const names = few.map(({ kind, name }) => `${kind} ${name}`).join("\n");
  const fresh = view.handled !== names;
  if (fresh) build(view, few, names);
  view.target = targets(view, few, chosen);
  if (fresh || few.length <= FEW) return view.target();
  if (chosen) view.target(chosen);
  view.waits ??= setTimeout(() => ((view.waits = null), view.target()), REST);
}

/** A function that puts the targets, or that of the chosen spot alone, over their spots. */
function targets({ layers, frame, scene, drawn }, few, chosen) {
  const least = gridStep(frame.scale) / 1000; // what a hand can tell apart: less is rounding
  const coordinate = (value) => stated(Math.abs(value) < least ? 0 : value, "m");
  const same = (one, other) => one.kind === other?.kind && one.name === other.name;
  return (only = null) => {
    const joints = only ? [] : few.filter(({ kind }) => kind !== "centres").map((one) => frame.to(one.at));
    few.forEach((one, order) => {
      if (only && !same(one, only)) return;
      const { kind, name, key, at, mass } = one;
      const [x, y] = frame.to((key && place(scene, key, drawn)) ?? at); // errors may be drawn larger
      const words = `${NOUNS[kind]} ${name}${mass ? `, ${Number(mass.toPrecision(4))} kg` : ""}, at ${coordinate(at[0])}, ${coordinate(at[1])}`;
      set(layers.handles.children[order], {
        cx: x.toFixed(1),
        cy: y.toFixed(1),
        "aria-label": words,
        class: same(one, chosen) ? "handle chosen" : mass && joints.some((spot) => Math.hypot(spot[0] - x, spot[1] - y) < TARGET) ? "handle under" : "handle",
      });
    });
  };
}

function build(view, spots, names) {
  const { handles } = view.layers;
  const active = document.activeElement;
  const held = active instanceof SVGElement && handles.contains(active) ? active.dataset : null;
  view.handled = names;
  handles.replaceChildren(
    ...spots.map(({ kind, name, key }) =>
      svg("circle", {
        r: TARGET,
        tabindex: 0,
        role: "button",
        "data-kind": kind,
        "data-name": name,
        "data-key": key,
      }),
    ),
  );
  if (held) [...handles.children].find((one) => one.dataset.kind === held.kind && one.dataset.name === held.name)?.focus();
}

/** Mark the chosen link, load or spring. */
export function markChosen(view, chosen) {
  for (const node of view.root.querySelectorAll("g[data-kind]")) {
    node.classList.toggle("chosen", node.dataset.kind === chosen?.kind && node.dataset.name === chosen.name);
  }
}
