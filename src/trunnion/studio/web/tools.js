// What a click does with each tool. A click is a spot (geometry.snap), whether the mouse or the keyboard made it.

import { signal } from "@preact/signals";
import { edit } from "./actions.js";
import { lengthOf, lengthUnit } from "./geometry.js";
import { pending, say, selection, tool } from "./state.js";

const TURN = Math.PI / 12; // guides turn by 15°

/** Letters typed for a length while a link is drawn. */
export const typedLength = signal("");
/** Where the pointer or the keyboard's cross is: {at, spot, keyboard, shift}, or null. */
export const pointer = signal(null);

export const TOOLS = [
  { id: "select", label: "Select", key: "V", hint: ["Drag a joint: the mechanism follows. Drag the sheet to shift it, turn the wheel to zoom."] },
  { id: "link", label: "Link", key: "L", hint: ["Click the first end of a link; Shift+click pins it to the ground.", "Click the second end, or type a length and press Enter. Shift+click pins it to the ground."], click: drawLink },
  { id: "pin", label: "Pin", key: "P", hint: ["Click a free point of a link to pin it to the ground."], click: pin },
  { id: "slide", label: "Guide", key: "G", hint: ["Click a point that slides in a guide on the ground.", "Click in the direction of the guide."], click: slide },
  { id: "driver", label: "Drive", key: "D", hint: ["Click the joint that is driven."], click: drive },
  { id: "point", label: "Point", key: "C", hint: ["Click a link: its new point draws a coupler curve."], click: addPoint },
  { id: "load", label: "Load", key: "F", hint: ["Click the point a force acts at; its size is set under Properties."], click: load },
  { id: "spring", label: "Spring", key: "S", hint: ["Click the first end of a spring.", "Click the second end of the spring."], click: spring },
  { id: "delete", label: "Delete", key: "X", hint: ["Click what is to go."], click: remove },
]; // prettier-ignore

export function choose(id) {
  tool.value = id;
  pending.value = null;
  typedLength.value = "";
  say(hint());
}

/** What to do next, in a sentence. */
export function hint() {
  const { hint: words } = TOOLS.find((one) => one.id === tool.value);
  return words[pending.value ? words.length - 1 : 0];
}

/** A click at a spot; `part` is the {kind, name, link} under it. */
export function click(spot, { shift = false, part = null } = {}) {
  TOOLS.find((one) => one.id === tool.value).click?.(spot, { shift, part });
}

/** The end of a link as a gesture says it. */
function endOf({ kind, end, at }, shift) {
  if (kind) return end;
  return shift ? { ground: at } : at;
}

function begin(spot, shift = false) {
  pending.value = { ...spot, written: endOf(spot, shift) };
  say(hint());
}

function drawLink(spot, { shift }) {
  const from = pending.value;
  if (!from) return begin(spot, shift);
  if (Math.hypot(spot.at[0] - from.at[0], spot.at[1] - from.at[1]) === 0) return;
  finish();
  edit([{ do: "link", from: from.written, to: endOf(spot, shift) }]);
}

function finish() {
  pending.value = null;
  typedLength.value = "";
}

/** Place the second end as far away as typed, towards the pointer. False if the text is no length. */
export function placeTyped(shift) {
  const from = pending.value;
  const aim = pointer.value?.spot.at;
  const length = lengthOf(typedLength.value, lengthUnit(pointer.value?.wide ?? 1));
  if (!from || !length) return false;
  const [dx, dy] = aim ? [aim[0] - from.at[0], aim[1] - from.at[1]] : [1, 0];
  const far = Math.hypot(dx, dy);
  const [ux, uy] = far > 0 ? [dx / far, dy / far] : [1, 0];
  const at = [from.at[0] + length * ux, from.at[1] + length * uy].map((value) => Number(value.toPrecision(12)));
  drawLink({ kind: null, at, end: at }, { shift });
  return true;
}

function pin({ kind, name }) {
  if (kind !== "points") return say("Only a free point of a link can be pinned to the ground.", true);
  edit([{ do: "pin", point: name }]);
}

function slide(spot) {
  const from = pending.value;
  if (!from) {
    if (!spot.kind) return say("Click a joint or a free point of a link: it will slide.", true);
    return begin(spot);
  }
  const turned = Math.atan2(spot.at[1] - from.at[1], spot.at[0] - from.at[0]);
  const angle = Math.round(turned / TURN) * TURN;
  finish();
  edit([{ do: "slide", joint: from.name, angle: Math.abs(angle) === Math.PI ? 0 : angle }]);
}

function drive({ kind, name }) {
  if (kind !== "joints") return say("Click a joint: a driver turns or slides one.", true);
  edit([{ do: "driver", joint: name }]);
}

function addPoint({ at }, { part }) {
  if (part?.kind !== "links") return say("Click a link: the point belongs to it.", true);
  edit([{ do: "add-point", link: part.name, at }]);
}

function load({ kind, key }) {
  if (!kind) return say("Click a joint or a point of a link: the force acts there.", true);
  const dot = key.indexOf(".");
  edit([{ do: "load", link: key.slice(0, dot), at: key.slice(dot + 1), force: ["0 N", "-100 N"] }]);
}

function spring(spot) {
  if (!spot.kind) return say("A spring runs between two points; set a point on the ground or on a link first.", true);
  const from = pending.value;
  if (!from) return begin(spot);
  if (from.key === spot.key) return;
  finish();
  edit([{ do: "spring", between: [from.key, spot.key], stiffness: "1 N/mm" }]);
}

function remove(spot, { part }) {
  const what = spot.kind ? { kind: spot.kind, name: spot.name } : part;
  if (what) removePart(what);
}

export function removePart({ kind, name }) {
  selection.value = null;
  edit([{ do: "delete", what: [kind, name] }]);
}

/** Leave off what was begun; where nothing was, the tool; where there is none, the selection. */
export function cancel() {
  if (pending.value) finish();
  else if (tool.value !== "select") choose("select");
  else selection.value = null;
}
