// The mechanism as Durango et al. draw it: a driver and Assur groups as blocks, wired by their pins. Motion goes down the
// wires in the order of solution, the loads come back up; both are those of the position that is shown.

import { effect, signal, untracked } from "@preact/signals";
import { Graph, layout } from "dagre";
import { useEffect, useRef, useState } from "preact/hooks";
import { set, svg } from "../web/dom.js";
import { magnitude } from "../web/data.js";
import { number, quantity } from "../web/format.js";
import { askOf, edit } from "./actions.js";
import { dictionary, groundOf } from "./geometry.js";
import { sheet } from "./sheet.js";
import * as state from "./state.js";
import { html } from "./ui.js";

const NODE = { width: 138, height: 46 };
const WIDEST = 8; // px, of the wire with the largest force; others by the root of theirs
const BEYOND = 10; // times the friction: a margin is looked for so far
const NAMES = { ground: "Ground", driver: "Driver" };

/** Answer to the latest `blocks` question, with the scene it is for; or null. */
export const wired = signal(null);
/** Number of the chosen block, or null. */
export const chosen = signal(null);

/** The parts of a block: {links, joints}. */
function partsOf(found, order) {
  const block = found?.blocks[order];
  if (!block) return { links: [], joints: [] };
  const own = found.wires.filter(({ to }) => to === order).map(({ joint }) => joint);
  return { links: block.links, joints: [...(block.inner ?? []), ...own] };
}

/** Ask for the blocks whenever the panel shows them and there is a new answer; light the parts of the chosen one. */
export function keepBlocks() {
  effect(() => {
    const scene = state.solved.value ? state.answer.value.scene : null;
    const wanted = state.tab.value === "blocks" || chosen.value !== null;
    untracked(() => {
      if (wired.value?.scene !== scene) wired.value = null;
      if (scene && wanted && !wired.value) askOf("blocks", {}).then((found) => found && takeIn({ ...found, scene }));
    });
  });
  effect(() => {
    const { kind, name } = state.selection.value ?? {};
    const found = wired.value;
    if (!found || !name || (kind !== "links" && kind !== "joints")) return;
    const order = found.blocks.findIndex((_, at) => partsOf(found, at)[kind].includes(name));
    if (order >= 0) untracked(() => (chosen.value = order));
  });
  effect(() => {
    const parts = partsOf(wired.value, chosen.value);
    state.index.value; // the sheet may have been drawn anew
    for (const node of sheet.view?.root.querySelectorAll("g[data-kind=links]") ?? []) node.classList.toggle("of-block", parts.links.includes(node.dataset.name));
  });
}

/** Show the blocks, and what they have to do with the locking margin once that is worked out. */
async function takeIn(found) {
  wired.value = found;
  if (!state.answer.value.margin) return;
  const more = await askOf("margins", {});
  if (more && wired.value === found) wired.value = { ...found, without: more.without };
}

/** Of a block at a position: the locking margin, and that without the friction of the block; null where there is none. */
function marginsOf(found, order, index) {
  const [all, without] = [state.answer.value?.margin?.[index], found?.without?.[order - 1]?.[index]];
  return all === undefined || all === null || without === undefined || without === null ? null : { all, without };
}

/** The structural formula over the sheet: each of its terms lights its block. */
export function Formula() {
  const { scene } = state.answer.value ?? {};
  if (!state.solved.value || !scene.formula) return null;
  const terms = scene.formula.split(" → ");
  const take = (order) => () => {
    chosen.value = chosen.value === order ? null : order;
    if (chosen.value !== null) state.tab.value = "blocks";
  };
  return html`<nav class="formula" aria-label="Structural formula">
    ${terms.map((term, at) => html`${at > 0 && html`<span aria-hidden="true">→</span>`}<button type="button" class="term" aria-pressed=${chosen.value === at + 1} title="Show this block and its links" onClick=${take(at + 1)}>${term}</button>`)}
  </nav>`; // prettier-ignore
}

export function Blocks() {
  const holder = useRef(null);
  useEffect(() => effect(() => void drawn(holder.current, wired.value)), []);
  useEffect(() => effect(() => posed(holder.current, wired.value, state.index.value, chosen.value)), []);
  return html`<div class="blocks">
    ${!state.solved.value && html`<p class="calm">Blocks appear as soon as the mechanism is solved.</p>`}
    <div ref=${holder}></div>
    ${wired.value?.without && html`<p class="calm bars-of-blocks"><span class="of-power">▬</span> share of the friction power <span class="of-locking">▬</span> by which the locking margin, looked for up to ${BEYOND}, is less for the friction of the block</p>`}
    ${wired.value && html`<${Values} found=${wired.value} />`}
    ${!state.spatial.value && html`<${Palette} />`}
  </div>`;
}

/** Lay the blocks out and draw them; which of them is chosen and what passes is `posed`. */
function drawn(holder, found) {
  if (!found) return holder.replaceChildren();
  const graph = new Graph({ multigraph: true });
  graph.setGraph({ rankdir: "TB", nodesep: 26, ranksep: 58, marginx: 10, marginy: 10 });
  graph.setDefaultEdgeLabel(() => ({}));
  found.blocks.forEach((_, order) => graph.setNode(String(order), { ...NODE }));
  found.wires.forEach(({ from, to, joint }) => graph.setEdge(String(from), String(to), { width: 22, height: 14, labelpos: "c" }, joint));
  layout(graph);
  const { width, height } = graph.graph();
  const root = svg("svg", { class: "wiring", viewBox: `0 0 ${width} ${height}`, style: `width: ${width}px`, role: "group", "aria-label": "Blocks of the mechanism and their wires" });
  const wires = found.wires.map((wire) => wireOf(graph.edge(String(wire.from), String(wire.to), wire.joint), wire));
  const nodes = found.blocks.map((block, order) => nodeOf(graph.node(String(order)), block, order, found));
  root.append(...wires.map(({ element }) => element), ...nodes);
  holder.replaceChildren(root);
  posed(holder, found, state.index.peek(), chosen.peek());
}

function wireOf({ points, x, y }, { joint, links }) {
  const d = `M${points.map((one) => `${one.x.toFixed(1)},${one.y.toFixed(1)}`).join("L")}`;
  const load = svg("path", { class: "load", d, pathLength: 100 });
  const line = svg("path", { class: "line", d });
  const label = svg("text", { x, y: y + 4, class: "pin" }, joint);
  const element = svg("g", { class: "wire", "data-joint": joint, tabindex: 0, role: "button", "aria-label": `Wire ${joint} from ${links[0]} to ${links[1]}` }, load, line, svg("rect", { x: x - 12, y: y - 8, width: 24, height: 16, rx: 4 }), label);
  const take = () => (state.selection.value = { kind: "joints", name: joint });
  element.addEventListener("click", take);
  element.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    take();
    event.preventDefault();
    event.stopPropagation();
  });
  return { element };
}

function nodeOf({ x, y }, block, order, found) {
  const { width, height } = NODE;
  const [left, top] = [x - width / 2, y - height / 2];
  const title = block.kind === "general" ? block.label : (NAMES[block.kind] ?? block.kind);
  const words = `${title}: ${block.links.join(", ")}`;
  const node = svg("g", { class: "block", tabindex: 0, role: "button", "data-block": order, "aria-label": words },
    svg("title", {}, words),
    svg("rect", { x: left, y: top, width, height, rx: 6 }),
    svg("text", { x, y: top + 18, class: "kind" }, title),
    svg("text", { x, y: top + 34, class: "of" }, shortened(block.links.join(", "))),
    svg("rect", { class: "share", x: left, y: top + height - 4, width: 0, height: 4 }),
    svg("rect", { class: "locking", x: left, y: top, width: 0, height: 4 })); // prettier-ignore
  const take = () => (chosen.value = chosen.value === order ? null : order);
  node.addEventListener("click", take);
  node.addEventListener("keydown", (event) => {
    const by = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
    if (by) node.parentNode.querySelector(`[data-block="${(order + by + found.blocks.length) % found.blocks.length}"]`).focus();
    else if (event.key === "Enter" || event.key === " ") take();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return node;
}

const shortened = (text) => (text.length > 21 ? `${text.slice(0, 20)}…` : text);

/** The largest of what a wire's force comes to, N. */
function peakOf(found) {
  found.peak ??= Math.max(...found.wires.flatMap(({ back }) => forces(back).map((value) => value ?? 0)), 0);
  return found.peak;
}

const forces = (back) => (back.force ? magnitude(back.force, Math.max(...Object.values(back.force).map((one) => one.length))) : []);

/** Wires as wide as their force, blocks with their share of the friction power, the chosen one marked. */
function posed(holder, found, index, block) {
  const root = holder?.querySelector("svg");
  if (!root || !found) return;
  const peak = peakOf(found);
  found.wires.forEach(({ joint, back, from, to }) => {
    const element = [...root.querySelectorAll(".wire")].find((one) => one.dataset.joint === joint);
    found.sizes ??= new Map();
    if (!found.sizes.has(joint)) found.sizes.set(joint, forces(back));
    const force = found.sizes.get(joint)[index];
    element.classList.toggle("chosen", block !== null && (from === block || to === block));
    set(element.querySelector(".load"), { "stroke-width": peak && force ? Math.max(WIDEST * Math.sqrt(force / peak), 0.6).toFixed(2) : 0 });
  });
  found.blocks.forEach(({ share }, order) => {
    const node = root.querySelector(`[data-block="${order}"]`);
    node.classList.toggle("chosen", order === block);
    node.setAttribute("aria-pressed", String(order === block));
    const margins = marginsOf(found, order, index);
    set(node.querySelector(".share"), { width: share?.[index] ? (NODE.width * share[index]).toFixed(1) : 0 });
    set(node.querySelector(".locking"), { width: margins ? (NODE.width * Math.max(1 - margins.all / margins.without, 0)).toFixed(1) : 0 });
  });
}

/** What enters and leaves the chosen block, or all of them, at the position that is shown. */
function Values({ found }) {
  const index = state.index.value;
  const order = chosen.value;
  const wires = found.wires.filter(({ from, to }) => order === null || from === order || to === order);
  const block = found.blocks[order];
  const share = block?.share?.[index];
  const margins = marginsOf(found, order, index);
  const upTo = (value) => (value >= BEYOND ? `> ${BEYOND}` : number(value, 3));
  const units = found.scene.units;
  const figure = (values, unit) => quantity(values[index], unit, undefined, units).replaceAll(" ", "\u00a0");
  const vector = (parts, unit) => (parts ? Object.values(parts).map((one) => figure(one, unit)).join(", ") : "—");
  const amount = (part, unit) => (part === undefined ? "—" : Array.isArray(part) ? figure(part, unit) : vector(part, unit));
  const goes = (wire) => (order === null ? `${wire.links[0]} → ${wire.links[1]}` : wire.to === order ? `from ${wire.links[0]}` : `to ${wire.links[1]}`);
  const backs = ({ type, back }) => [
    ...(type === "revolute" && Array.isArray(back.moment) ? [] : [["moment", amount(back.moment, "N m")]]),
    ["friction", amount(back.friction, type === "prismatic" ? "N" : "N m")],
  ];
  return html`<section class="passing" aria-label="What passes the wires">
    <h2>${block ? block.label : "All wires"}</h2>
    ${block && html`<p class="calm">${block.links.join(", ")}${share === null || share === undefined ? "" : `; ${number(100 * share, 3)} % of the friction power`}</p>`}
    ${margins && html`<p class="calm">Locking margin here ${upTo(margins.all)}${margins.all >= BEYOND ? ", far from locking" : `; without the friction of this block ${upTo(margins.without)}`}.</p>`}
    <div class="scrolls"><table>
      <thead><tr><th>pin</th><th>forward</th><th>back</th></tr></thead>
      <tbody>${wires.map((wire) => html`<tr><th>${wire.joint}<br /><span class="calm">${goes(wire)}</span></th>
        <td><span class="calm">at</span> ${vector(wire.forward.position, "m")}<br /><span class="calm">with</span> ${vector(wire.forward.velocity, "m/s")}</td>
        <td><span class="calm">force</span> ${vector(wire.back.force, "N")}${backs(wire).map(([word, text]) => html`<br /><span class="calm">${word}</span> ${text}`)}</td></tr>`)}</tbody>
    </table></div>
  </section>`; // prettier-ignore
}

// ---- building by blocks ----------------------------------------------------------------------------------------------

const KINDS = {
  driver: { label: "Driver (crank on the ground)", pins: 0 },
  RRR: { label: "RRR: two links between two pins", pins: 2 },
  RRP: { label: "RRP: a rod and a slider on the ground", pins: 1 },
  RPR: { label: "RPR: a slider along a link, between two pins", pins: 2 },
  PRP: { label: "PRP: a pin between a link and a guide", pins: 1 },
  RPP: { label: "RPP: a pin in the slot of a guided link", pins: 1 },
  CCC: { label: "CCC: three cylindrical pairs, with a driver a loop in space", pins: 0 },
  triad: { label: "Class III: a plate on three rods", pins: 3 },
  gear: { label: "Gears of two pivots", pins: 2 },
};

/** Pins that a block can be wired to: joints, free ends, and a new pin on the ground. */
function pinsOf() {
  const { entries } = state.answer.value ?? {};
  const joints = Object.keys(dictionary(entries?.joints));
  const ground = groundOf(entries);
  const points = Object.entries(dictionary(entries?.links))
    .filter(([link]) => link !== ground)
    .flatMap(([link, { points: own }]) => Object.keys(dictionary(own)).filter((name) => !joints.includes(name)).map((name) => `${link}.${name}`));
  return [...[...joints, ...points].map((name) => ({ value: name, label: name })), { value: "", label: "a new pin on the ground" }];
}

/** A block of the list, its pins chosen or typed, becomes links and joints of the drawing. */
function Palette() {
  const [kind, setKind] = useState("driver");
  const [pins, setPins] = useState([null, "", ""]);
  const [typed, setTyped] = useState({ ground: ["0 mm, 0 mm", "100 mm, 0 mm", "100 mm, 100 mm"], at: "", ratio: "20:40" });
  const choices = pinsOf();
  const free = choices.find(({ value }) => value.includes("."))?.value ?? ""; // what the first pin is wired to until it is chosen
  const there = (order) => (choices.some(({ value }) => value === pins[order]) ? pins[order] : order ? "" : free); // it may be gone
  const { pins: count } = KINDS[kind];
  const fields = kind === "CCC" ? 0 : Math.max(count, 1);
  const take = (order) => (event) => setPins(pins.map((one, at) => (at === order ? event.target.value : one)));
  const write = (order) => (event) => setTyped({ ...typed, ground: typed.ground.map((one, at) => (at === order ? event.target.value : one)) });
  const place = async (event) => {
    event.preventDefault();
    const ends = Array.from({ length: fields }, (_, order) => (count && there(order) ? there(order) : { ground: typed.ground[order] }));
    if (!(await edit([{ do: "block", kind, pins: ends, at: typed.at, ratio: typed.ratio }]))) return;
    setTyped({ ...typed, at: "" });
    setPins([null, "", ""]);
    if (state.spatial.value) return;
    sheet.fit();
    if (choices.length < 2) sheet.zoom(0.4); // a first block has room for more
  };
  const inner = { driver: "End at", RPR: "End at", RPP: "Guide at", CCC: "Angle between the shafts", triad: "Middle at" }[kind] ?? "Inner pin at";
  return html`<form class="palette" aria-label="Add a block" onSubmit=${place}>
    <h2>Add a block</h2>
    <label>Block <select aria-label="Kind of block" value=${kind} onChange=${(event) => (setKind(event.target.value), setTyped({ ...typed, at: "" }))}>${Object.entries(KINDS).map(([name, { label }]) => html`<option value=${name}>${label}</option>`)}</select></label>
    ${Array.from({ length: fields }, (_, order) => html`<label>Pin ${order + 1}
      ${count > 0 && html`<select aria-label=${`Pin ${order + 1}`} value=${there(order)} onChange=${take(order)}>${choices.map(({ value, label }) => html`<option value=${value}>${label}</option>`)}</select>`}
      ${(!count || !there(order)) && kind !== "gear" && html`<input aria-label=${`Place of pin ${order + 1}`} value=${typed.ground[order]} onInput=${write(order)} />`}</label>`)}
    ${kind === "gear"
      ? html`<label>Ratio <input aria-label="Ratio" value=${typed.ratio} onInput=${(event) => setTyped({ ...typed, ratio: event.target.value })} /></label>`
      : html`<label>${inner} <input aria-label=${inner} placeholder="as it fits" value=${typed.at} onInput=${(event) => setTyped({ ...typed, at: event.target.value })} /></label>`}
    <button type="submit" class="plain">Place the block</button>
  </form>`; // prettier-ignore
}
