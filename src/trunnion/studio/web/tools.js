// What a click does with each tool. A click is a spot (geometry.snap), whether the mouse or the keyboard made it.

import { signal } from "@preact/signals";
import { edit } from "./actions.js";
import { gridStep, lengthOf, lengthText, lengthUnit } from "./geometry.js";
import { numberOf, plainNumber } from "./fields.js";
import { chooseBox } from "./group.js";
import { crossingAt, linkOf, resisted } from "./sheet.js";
import { group, pending, say, selection, spatial, tool } from "./state.js";

const TURN = Math.PI / 12; // guides and forces turn by 15°
const FORCE = "100 N"; // of a load that is drawn without a number
const TORQUE = "10 N m"; // of one against the motion of a joint that turns
const IN_SPACE = "Drag turns the mechanism. With Shift a drag shifts it, and the wheel zooms. Click a link or joint to choose it.";

/** Letters typed while something is drawn: its length, force, stiffness, ratio or angle. */
export const typed = signal("");
/** Where the pointer or the keyboard's cross is: {at, spot, keyboard, shift}, or null. */
export const pointer = signal(null);

/**
 * Tools; of those with two clicks `tells` says what the second would make, `begins` is how a typed value begins.
 * @type {{ id: string, label: string, key: string, hint: string[], click?: Function, tells?: Function, begins?: RegExp, on?: boolean }[]}
 */
export const TOOLS = [
  { id: "select", label: "Select", key: "V", hint: ["Drag a joint: along its path the mechanism moves, off it lengths change."] },
  { id: "box", label: "Box", key: "B", hint: ["Drag a box around links, or click its corners: they are chosen together. Shift+click on a link adds it.", "Click the other corner."], click: box },
  { id: "link", label: "Link", key: "L", hint: ["Click the first end: a joint, a place on a link, or a free place. Shift+click pins it to the ground.", "Click the second end, or type a length and press Enter. Shift+click pins it to the ground."], click: drawLink, tells: tellLength, begins: /[0-9.,]/, on: true },
  { id: "pin", label: "Pin", key: "P", hint: ["Click a free point of a link, or a place on a link, to pin it to the ground."], click: pin, on: true },
  { id: "join", label: "Join", key: "J", hint: ["Click an end, or a place where two links cross: a pin joins them there.", "Click the end or the link it is joined with; the first end goes there."], click: join, on: true },
  { id: "slide", label: "Slide", key: "G", hint: ["Click what slides: a free end, a pin, or a link itself.", "Click the link it slides along, or the direction of a guide on the ground, or type an angle."], click: slide, tells: tellAngle, begins: /[0-9.,-]/, on: true },
  { id: "gear", label: "Gears", key: "E", hint: ["Click the pivot of the first gear, or its link.", "Click the pivot of the second gear. For a ratio type the teeth first, as 20:40."], click: gear, tells: tellRatio, begins: /[0-9.,+]/, on: true },
  { id: "driver", label: "Drive", key: "D", hint: ["Click the joint that is driven."], click: drive },
  { id: "point", label: "Point", key: "C", hint: ["Click the link that the point belongs to.", "Click where on it, or beside it, the point is."], click: addPoint, on: true },
  { id: "load", label: "Load", key: "F", hint: ["Click the joint, point or link that the force acts on.", "Click the direction of the force, or the same slide, pivot or link again for one against its motion; type its size first, as 250 N."], click: load, tells: tellForce, begins: /[0-9.,]/, on: true },
  { id: "spring", label: "Spring", key: "S", hint: ["Click the first end of a spring: a point, a link, or the ground.", "Click the second end; type the stiffness first, as 2 N/mm."], click: spring, tells: tellStiffness, begins: /[0-9.,]/, on: true },
  { id: "delete", label: "Delete", key: "X", hint: ["Click what is to go."], click: remove },
]; // prettier-ignore

export const toolOf = () => TOOLS.find((one) => one.id === tool.value);

export function choose(id) {
  tool.value = id;
  finish();
  say(hint());
}

/** What to do next, in a sentence; where fingers are all there is, without what asks for keys. */
export function hint() {
  const { hint: words } = toolOf();
  const own = spatial.value ? IN_SPACE : words[pending.value ? words.length - 1 : 0];
  const touched = matchMedia("(hover: none) and (pointer: coarse)").matches;
  return touched ? own.replace(/ [^.]*\b(Shift|Alt)\b[^.]*\./g, "").replace(/\bClick\b/g, "Touch") : own;
}

/** A click at a spot; `part` is the {kind, name, link} under it. */
export function click(spot, { shift = false, part = null } = {}) {
  toolOf().click?.(spot, { shift, part });
}

/** An end as a gesture says it: a joint, a point, a place on a link, on the ground, or anywhere. */
export function endOf({ kind, name, on, at }, shift = false) {
  if (kind) return name;
  return shift ? { ground: at } : on ? { on, at } : at;
}

function begin(spot, shift = false) {
  pending.value = { ...spot, written: endOf(spot, shift) };
  say(hint());
}

function finish() {
  pending.value = null;
  typed.value = "";
}

/** Direction from the first click to the pointer, rad, by 15°; `aim` is the place of the pointer. */
function turnTo(aim) {
  const { at } = pending.value;
  const angle = Math.round(Math.atan2(aim[1] - at[1], aim[0] - at[0]) / TURN) * TURN;
  return angle <= -Math.PI ? Math.PI : angle;
}

/** Place the second end as typed, towards the pointer. False if the text is no such value. */
export function placeTyped(shift) {
  const aim = pointer.value?.spot.at ?? pending.value.at;
  if (tool.value === "link") return placeLength(shift, aim);
  if (tool.value === "slide") return guideTyped();
  if (tool.value === "load") return putLoad(aim);
  say("Now click the other end.");
  return true;
}

/** Two corners of a box choose links. */
function box({ at }) {
  const from = pending.value;
  if (!from) return begin({ kind: null, at });
  finish();
  chooseBox(from.at, at);
  choose("select");
}

// ---- links and points

function drawLink(spot, { shift }) {
  const from = pending.value;
  if (!from) return begin(spot, shift);
  if (Math.hypot(spot.at[0] - from.at[0], spot.at[1] - from.at[1]) === 0) return;
  finish();
  edit([{ do: "link", from: from.written, to: endOf(spot, shift), length: spot.length }]);
}

/** Where a link of the typed length ends, towards a place; null where no length is typed. */
export function typedEnd(aim) {
  const { at } = pending.value;
  const length = tool.value === "link" ? lengthOf(typed.value, lengthUnit(pointer.value?.wide ?? 1)) : null;
  if (!length) return null;
  const [dx, dy] = [aim[0] - at[0], aim[1] - at[1]];
  const far = Math.hypot(dx, dy);
  const [ux, uy] = far > 0 ? [dx / far, dy / far] : [1, 0];
  return [at[0] + length * ux, at[1] + length * uy].map((value) => Number(value.toPrecision(12)));
}

function placeLength(shift, aim) {
  const at = typedEnd(aim);
  if (!at) return false;
  drawLink({ kind: null, at, end: at, length: withUnit(typed.value, lengthUnit(pointer.value?.wide ?? 1)) }, { shift });
  return true;
}

/** Typed letters as the file writes them: with a decimal point, and a unit. */
function withUnit(letters, unit) {
  const { value, rest } = numberOf(letters.replace(",", "."));
  return `${value} ${rest || unit}`;
}

function tellLength(a, b, frame) {
  const unit = lengthUnit(frame.width / frame.scale);
  const [dx, dy] = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
  const angle = ((Math.atan2(dy, dx) * 180) / Math.PI).toFixed(1);
  if (typed.value) return `${typed.value}${/[a-z]/i.test(typed.value) ? "" : ` ${unit}`} ⏎`;
  return `${lengthText(Math.hypot(dx, dy), unit, gridStep(frame.scale) / 10)}, ${angle}°${b.kind || b.on ? `, joined to ${b.kind ? b.name : b.on}` : ""}`;
}

function pin(spot) {
  if (spot.kind !== "points" && !spot.on) return say("Click a free point of a link, or a place on a link: it is pinned to the ground there.", true);
  edit([{ do: "pin", point: endOf(spot) }]);
}

/** Two ends become a pin, or the places of two links where they cross. */
function join(spot) {
  const from = pending.value;
  if (!spot.kind && !spot.on) return say("Click an end of a link, a joint, or a link.", true);
  if (from) {
    finish();
    return edit([{ do: "join", ends: [from.written, endOf(spot)] }]);
  }
  const meet = spot.kind ? null : crossingAt(spot.at);
  if (!meet) return begin(spot);
  edit([{ do: "join", ends: meet.on.map((on) => ({ on, at: meet.at })) }]);
}

function addPoint(spot) {
  const { on, at } = spot;
  const from = pending.value;
  if (from) {
    finish();
    return edit([{ do: "add-point", link: from.on, at }]);
  }
  const link = on ?? linkOf(spot);
  if (!link) return say("Click a link: the point belongs to it.", true);
  begin({ ...spot, on: link });
}

// ---- guides, slots, gears

/** What slides, and where: a pin that is clicked after a link slides along that link. */
function slidden(from, spot) {
  const other = from.on && spot.kind ? linkOf(spot, from.on) : null;
  return other && other !== from.on ? [{ ...spot, written: endOf(spot) }, from] : [from, spot];
}

function slide(clicked) {
  if (!pending.value) {
    if (!clicked.kind && !clicked.on) return say("Click a joint, the free end of a link, or a link: it will slide.", true);
    return begin(clicked);
  }
  const [from, spot] = slidden(pending.value, clicked);
  const own = from.on ?? linkOf(from);
  const along = spot.on ?? linkOf(spot, own);
  const apart = Math.hypot(spot.at[0] - from.at[0], spot.at[1] - from.at[1]) > 0;
  if (!apart && !(along && along !== own)) return say("Click beside it, in the direction of the guide, or on another link.", true);
  const turned = along && along !== own ? { along, near: pointer.value?.near ?? 0 } : { angle: level(turnTo(spot.at)) };
  finish();
  edit([{ do: "slide", joint: from.written, ...turned }]);
}

/** A guide has no sense: 180° is 0°. */
const level = (angle) => (Math.abs(angle) === Math.PI ? 0 : angle);

function guideTyped() {
  const found = numberOf(plainNumber(typed.value.replace(/°|deg$/, "")));
  if (!found || found.rest) return false;
  const { written } = pending.value;
  finish();
  edit([{ do: "slide", joint: written, angle: (found.value * Math.PI) / 180 }]);
  return true;
}

function tellAngle(first, second) {
  const [a, b] = slidden(first, second);
  const along = b.on ?? linkOf(b, a.on ?? linkOf(a));
  if (typed.value) return `${typed.value}° ⏎`;
  if (along && along !== (a.on ?? linkOf(a))) return a === first ? `along ${along}` : `${a.name.split(".").pop()} along ${along}`;
  return `guide at ${Math.round((level(turnTo(b.at)) * 180) / Math.PI)}°`;
}

function gear(spot) {
  const from = pending.value;
  if (spot.kind !== "joints" && !spot.on) return say("Click a pivot on the ground, or the link that turns about it.", true);
  if (!from) return begin(spot);
  const ratio = typed.value;
  finish();
  edit([{ do: "gear", joints: [from.written, endOf(spot)], ...(ratio && { ratio: ratio.replace(",", ".") }) }]);
}

function tellRatio() {
  return typed.value ? (/[:/]/.test(typed.value) ? `teeth ${typed.value}` : `${typed.value} turns for one`) : "1 : 1";
}

// ---- what acts

function drive({ kind, name }) {
  if (kind !== "joints") return say("Click a joint: a driver turns or slides one.", true);
  edit([{ do: "driver", joint: name }]);
}

function load(spot) {
  if (pending.value) return void putLoad(spot.at);
  if (!spot.kind && !spot.on) return say("Click a joint, a point or a link: the force acts there.", true);
  begin(spot);
}

/** A force or torque as it is typed, {value, unit}; null if it is none. */
function effortOf(letters, turns = false) {
  const found = numberOf(plainNumber(letters));
  const units = turns ? /^([kM]?N ?m|lbf ft)?$/ : /^([kM]?N|lbf)?$/;
  return found && found.value > 0 && units.test(found.rest) ? { value: found.value, unit: found.rest || (turns ? "N m" : "N") } : null;
}

/** The joint whose motion a load opposes that points back at where it was begun; null where it has a direction. */
function opposed(from, aim) {
  const far = Math.hypot(aim[0] - from.at[0], aim[1] - from.at[1]);
  return far <= (from.on ? (pointer.value?.near ?? 0) / 2 : 0) ? resisted(from) : null; // half, for one step of the grid is a direction
}

function putLoad(aim) {
  const from = pending.value;
  const joint = opposed(from, aim);
  const turns = Boolean(joint) && joint.type !== "prismatic";
  const size = effortOf(typed.value || (turns ? TORQUE : FORCE), turns);
  if (!size) return false;
  const angle = Math.hypot(aim[0] - from.at[0], aim[1] - from.at[1]) > 0 ? turnTo(aim) : -Math.PI / 2;
  const force = [Math.cos(angle), Math.sin(angle)].map((part) => `${Number((size.value * part).toFixed(9)) + 0} ${size.unit}`);
  finish();
  edit([joint ? { do: "load", against: joint.name, size: `${size.value} ${size.unit}` } : { do: "load", at: from.written, force }]);
  return true;
}

function tellForce(from, b) {
  const joint = opposed(from, b.at);
  const turns = joint && joint.type !== "prismatic";
  const letters = typed.value || (turns ? TORQUE : FORCE);
  const size = `${letters}${/[a-z]/i.test(letters) ? "" : turns ? " N m" : " N"}`;
  return `${size}${joint ? ` against the motion of ${joint.name}` : `, ${Math.round((turnTo(b.at) * 180) / Math.PI)}°`}${typed.value ? " ⏎" : ""}`;
}

function spring(spot) {
  const from = pending.value;
  if (!from) return begin(spot);
  if (Math.hypot(spot.at[0] - from.at[0], spot.at[1] - from.at[1]) === 0) return;
  const found = typed.value ? numberOf(plainNumber(typed.value)) : { value: 1, rest: "" };
  if (!found) return say(`“${typed.value}” is no stiffness; type one as 2 or 2 N/mm.`, true);
  finish();
  edit([{ do: "spring", between: [from.written, endOf(spot)], stiffness: `${found.value} ${found.rest || "N/mm"}` }]);
}

function tellStiffness() {
  const letters = typed.value || "1 N/mm";
  return `${letters}${/[a-z]/i.test(letters) ? "" : " N/mm"}`;
}

// ---- what goes

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
  else {
    selection.value = null;
    group.value = [];
  }
}
