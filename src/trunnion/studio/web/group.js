// Several links at once: chosen by a box, by Shift and a click, or all; shifted, copied, mirrored, deleted.

import { place } from "../web/data.js";
import { svg } from "../web/dom.js";
import { outline } from "../web/plane.js";
import { edit, present } from "./actions.js";
import { dictionary, groundOf, onGrid, placesAt } from "./geometry.js";
import { partsAt, sheet } from "./sheet.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

/** The links that are chosen together and still there. */
export function chosenLinks() {
  const links = dictionary(state.answer.value?.entries?.links);
  return state.group.value.filter((name) => name in links);
}

/** The moving links of the sheet. */
export function allLinks() {
  const { entries } = state.answer.peek() ?? {};
  return Object.keys(dictionary(entries?.links)).filter((name) => name !== groundOf(entries));
}

export function chooseLinks(names) {
  state.group.value = names;
  if (names.length) state.selection.value = null;
  state.say(names.length ? `${counted(names)} chosen: drag or use the arrow keys to move ${names.length > 1 ? "them" : "it"}.` : "No link lies in the box.", !names.length);
}

const counted = (names) => (names.length === 1 ? names[0] : `${names.length} links`);

/** Add a link to those chosen, or take it out. */
export function toggleLink(name) {
  const names = chosenLinks();
  chooseLinks(names.includes(name) ? names.filter((one) => one !== name) : [...names, name]);
}

/** Choose the links all of whose points lie in a box between two corners, m. */
export function chooseBox(/** @type {number[]} */ [x, y], /** @type {number[]} */ [a, b]) {
  const inside = (spot) => (spot[0] - x) * (spot[0] - a) <= 0 && (spot[1] - y) * (spot[1] - b) <= 0;
  chooseLinks(allLinks().filter((name) => spotsOf(name).length && spotsOf(name).every(inside)));
}

function spotsOf(name) {
  const { scene, posed } = sheet.view;
  return (scene.links.find((one) => one.name === name)?.points ?? []).map((key) => place(scene, key, posed)).filter(Boolean);
}

/** The middle of some links, on the grid. */
function middleOf(names) {
  const spots = names.flatMap(spotsOf);
  return [0, 1].map((axis) => {
    const parts = spots.map((spot) => spot[axis]);
    return onGrid((Math.min(...parts) + Math.max(...parts)) / 2, sheet.step() / 2);
  });
}

async function change(names, fields) {
  const scene = fields.at && state.solved.value ? state.answer.value.scene : null; // a mirrored mechanism is assembled where it starts
  const places = scene && { ...present().places, ...placesAt(scene, 0) };
  const done = await edit([{ do: "group", links: names, start: Boolean(places), ...fields }], null, places);
  if (done && fields.what === "delete") state.group.value = [];
  return done;
}

/** What can be done with some links, [[label, key, does]]. */
export function groupActions(names) {
  const aside = () => [0, 1].map(() => 2 * sheet.step());
  return [
    ["Copy", "Ctrl D", () => change(names, { what: "copy", by: aside() })],
    ["Mirror left to right", "", () => change(names, { what: "mirror", at: middleOf(names) })],
    ["Mirror top to bottom", "", () => change(names, { what: "mirror", at: middleOf(names), level: true })],
    ["Mirror a copy", "", () => change(names, { what: "copy", at: rightOf(names) })],
    [names.length > 1 ? `Delete ${names.length} links` : `Delete link`, "Delete", () => change(names, { what: "delete" })],
  ]; // prettier-ignore
}

/** Right of some links: where the mirror of a copy stands. */
function rightOf(names) {
  const spots = names.flatMap(spotsOf);
  return [onGrid(Math.max(...spots.map(([x]) => x)) + sheet.step(), sheet.step()), middleOf(names)[1]];
}

export const shift = (by, merge = null) => edit([{ do: "group", what: "shift", links: chosenLinks(), by }], merge);

/** What a hand holds that drags the chosen links, or draws a box around some; null where it is neither. */
export function groupHeld(view, { spot, part, start }, shifted) {
  const from = view.frame.from(start);
  if (state.tool.value === "box" || (state.tool.value === "select" && shifted && !part)) {
    return {
      to: (at) => (state.boxed.value = [from, at]),
      drop: () => state.boxed.value && chooseBox(state.boxed.value[0], state.boxed.value[1]),
      leave: () => (state.boxed.value = null),
    };
  }
  const names = chosenLinks();
  const on = part && (part.kind === "links" ? names.includes(part.name) : partsAt(spot.at).some(({ kind, name }) => kind === "links" && names.includes(name)));
  if (state.tool.value !== "select" || !on) return null;
  let by = [0, 0];
  return {
    to(at) {
      by = at.map((part, axis) => onGrid(part - from[axis], state.snapping.value ? sheet.step() : sheet.step() / 100));
      state.shifted.value = by;
    },
    drop: () => Math.hypot(...by) > 0 && shift(by),
    leave: () => (state.shifted.value = null),
  };
}

/** Box and outlines of what is chosen, as they are dragged. */
export function groupMarks({ frame, scene }) {
  if (!scene) return [];
  const by = state.shifted.value ?? [0, 0];
  const moved = (spot) => frame.to([spot[0] + by[0], spot[1] + by[1]]);
  const marks = chosenLinks().map((name) => svg("path", { class: "of-group", d: outline(spotsOf(name).map(moved)) }));
  if (!state.boxed.value) return marks;
  const [from, to] = state.boxed.value;
  return [...marks, boxTo(frame, from, to)];
}

/** The box between two corners, m. */
export function boxTo(frame, a, b) {
  const [[x, y], [u, v]] = [frame.to(a), frame.to(b)];
  return svg("rect", { class: "box", x: Math.min(x, u), y: Math.min(y, v), width: Math.abs(u - x), height: Math.abs(v - y) });
}

/** Over the sheet: what can be done with the links that are chosen. */
export function GroupBar() {
  const names = chosenLinks();
  if (!names.length) return null;
  return html`<div class="message-card group-bar" role="toolbar" aria-label="Chosen links"><b>${counted(names)}</b>
    ${groupActions(names).map(([label, key, does]) => html`<${Button} label=${label} title=${key ? `${label} (${key})` : label} onClick=${does} />`)}
    <${Button} label="Leave" title="Choose nothing (Escape)" onClick=${() => (state.group.value = [])} /></div>`; // prettier-ignore
}
