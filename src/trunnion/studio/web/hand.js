// The pointer on the sheet: click, drag a joint, pan, zoom, also by two fingers. One question to Python at a time while a joint is dragged.

import { batch } from "@preact/signals";
import { place } from "../web/data.js";
import { changed, edit, newest, present } from "./actions.js";
import { gridStep, onGrid } from "./geometry.js";
import { takeOther } from "./ghosts.js";
import { groupHeld, toggleLink } from "./group.js";
import { centreHeld, chosenOf } from "./masses.js";
import { openMenu } from "./menu.js";
import { apart, drawn, dropAt, partUnder, sheet } from "./sheet.js";
import * as state from "./state.js";
import { choose, click, endOf, pointer, toolOf } from "./tools.js";

const STILL = 3; // px that a click may move
const LONG = 550; // ms of a finger at rest until the menu opens
const ON_PATH = 8; // px from its path within which a joint is on it

/** Listen to the pointer; returns what ends it. */
export function listenToPointer(root, view) {
  const hand = { held: null };
  const fingers = new Map(); // where they are, px, by pointer
  const placed = (event) => {
    const box = hand.held?.box ?? root.getBoundingClientRect(); // to measure it at each step takes longer than to draw
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const follow = (event) => {
    const part = toolOf().on ? partUnder(event.target) : null;
    const spot = sheet.snapOn(view.frame.from(placed(event)), event.altKey, part);
    pointer.value = { spot, keyboard: false, ...sheet.scale() };
    return spot;
  };
  root.addEventListener("pointerdown", (event) => {
    const spot = follow(event);
    const part = partUnder(event.target);
    const panning = event.button === 1 || event.button === 2;
    if (event.pointerType === "touch") fingers.set(event.pointerId, placed(event));
    if (fingers.size > 1) return letGo(hand);
    if (event.button > 2 || hand.held) return;
    clearTimeout(hand.waits);
    root.setPointerCapture(event.pointerId);
    hand.held = { box: root.getBoundingClientRect(), start: placed(event), last: placed(event), spot, part, panning, moved: false };
    hand.held.group = panning ? null : groupHeld(view, hand.held, event.shiftKey);
    if (event.pointerType === "touch") hand.waits = setTimeout(() => longTouch(view, hand), LONG);
  });
  root.addEventListener("pointermove", (event) => {
    if (fingers.size > 1 && fingers.has(event.pointerId)) return spread(fingers, event.pointerId, placed(event));
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, placed(event));
    follow(event);
    if (hand.held) pull(view, hand.held, placed(event), event.altKey);
  });
  root.addEventListener("pointerup", (event) => {
    fingers.delete(event.pointerId);
    clearTimeout(hand.waits);
    const { held } = hand;
    hand.held = null;
    if (held && !held.moved && event.button === 2) return openMenu(held.part, view.frame.from(held.start));
    if (held) release(held, event.shiftKey);
  });
  root.addEventListener("pointercancel", (event) => {
    fingers.delete(event.pointerId);
    letGo(hand);
  });
  root.addEventListener("pointerleave", () => {
    if (!state.pending.value) pointer.value = null;
  });
  root.addEventListener("contextmenu", (event) => event.preventDefault());
  const wheel = (event) => {
    event.preventDefault();
    sheet.zoom(1.0015 ** -event.deltaY, placed(event));
  };
  root.addEventListener("wheel", wheel, { passive: false });
  return () => root.removeEventListener("wheel", wheel);
}

/** A finger that rests opens the menu of what is under it. */
function longTouch(view, hand) {
  const { held } = hand;
  if (!held || held.moved) return;
  letGo(hand);
  openMenu(held.part, view.frame.from(held.start));
}

/** Leave off what is held, as if it had never been taken. */
function letGo(hand) {
  const { joint, centre } = hand.held ?? {};
  centre?.leave();
  hand.held?.group?.leave();
  clearTimeout(hand.waits);
  hand.held = null;
  state.live.value = null;
  state.dropping.value = null;
  if (!joint) return;
  joint.left = true;
  if (joint.sketched) state.places.value = joint.base.places;
}

/** Two fingers shift and zoom the sheet with them; one of them, `id`, is at another place now. */
function spread(fingers, id, at) {
  const measured = () => {
    const [[ax, ay], [bx, by]] = [...fingers.values()];
    return { wide: Math.hypot(bx - ax, by - ay), middle: [(ax + bx) / 2, (ay + by) / 2] };
  };
  const before = measured();
  fingers.set(id, at);
  const { wide, middle } = measured();
  sheet.pan(middle[0] - before.middle[0], middle[1] - before.middle[1]);
  if (before.wide && wide) sheet.zoom(wide / before.wide, middle);
}

function pull(view, held, at, alt) {
  const far = Math.hypot(at[0] - held.start[0], at[1] - held.start[1]);
  if (!held.moved && far <= STILL) return;
  if (!held.moved && !held.group) takeHold(view, held);
  held.moved = true;
  if (held.group) return void held.group.to(view.frame.from(at));
  if (held.joint) dragTo(held.joint, view.frame.from(at), view.frame.scale, alt);
  else if (held.centre) held.centre.to(view.frame.from(at).map((value) => onGrid(value, sheet.step() / (alt ? 100 : 10))));
  else if (held.panning || state.tool.value === "select") sheet.pan(at[0] - held.last[0], at[1] - held.last[1]);
  held.last = at;
}

function takeHold(view, held) {
  const { kind, name, key } = held.part ?? {};
  if (kind === "centres" && !held.panning && state.tool.value === "select") {
    held.centre = centreHeld(view, name);
    return;
  }
  if (held.panning || state.tool.value !== "select" || (kind !== "joints" && kind !== "points")) return;
  const base = present();
  const { sketched, scene } = drawn.peek();
  const path = sketched ? null : pathOf(scene, key);
  held.joint = { kind, name, key, index: view.posed, asked: null, told: "", sketched, base, together: sketched ? together(kind, name, base.places) : [], path, scene, crank: Boolean(path) && driven(scene, name, key) };
  const { joint } = held;
  joint.ask = newest((to) => changed("drag", { point: name, index: joint.index, to, keep: joint.keep }), (found, to) => follow(joint, found, to));
  joint.chosen = { kind, name };
  if (sketched) state.selection.value = joint.chosen;
}

/** The points that lie in one joint, of a mechanism that is only drawn yet. */
function together(kind, name, places) {
  return kind === "joints" ? Object.keys(places).filter((key) => key.endsWith(`.${name}`)) : [name];
}

/** Where a point goes over the cycle, [[x, y] or null]; null for one that stays. */
function pathOf(scene, key) {
  const { x = [], y = [] } = scene.points[key] ?? {};
  return Math.max(x.length, y.length) > 1 ? Array.from({ length: scene.count }, (_, index) => place(scene, key, index)) : null;
}

/** Whether a joint or point is on a link that a drive on the ground moves. */
function driven(scene, name, key) {
  const ground = scene.links.find((link) => link.ground)?.name;
  const drives = scene.drivers.map((one) => scene.joints.find((joint) => joint.name === one.name)).filter((joint) => joint?.links.includes(ground));
  const moved = drives.flatMap(({ links }) => links);
  const own = scene.joints.find((joint) => joint.name === name)?.links ?? [key.split(".")[0]];
  return own.some((link) => link !== ground && moved.includes(link));
}

/**
 * The position at which a joint is nearest to a place; null where that is farther than ON_PATH px from its path, unless a drive turns it.
 * Of positions equally near the one next to the present.
 */
function poseAt({ path, crank, scene }, at, scale) {
  const far = path.map((spot) => (spot ? scale * Math.hypot(spot[0] - at[0], spot[1] - at[1]) : Infinity));
  const least = Math.min(...far);
  if (!(least <= ON_PATH || (crank && least < Infinity))) return null;
  const now = state.index.peek();
  const apart = (index) => {
    const by = Math.abs(index - now);
    return scene.abscissa.closed ? Math.min(by, scene.count - by) : by;
  };
  const near = far.flatMap((one, index) => (one <= least + (crank ? 1e-3 : 1) ? [index] : []));
  return near.reduce((best, one) => (apart(one) < apart(best) ? one : best));
}

/** Off its path a joint changes lengths; along it, and always where a drive turns it, it turns the mechanism, unless Alt is held. */
function dragTo(joint, at, scale, alt) {
  const index = joint.path && !alt ? poseAt(joint, at, scale) : null;
  joint.posed = index !== null;
  if (joint.posed) {
    state.live.value = null;
    state.index.value = index;
    state.selection.value = joint.chosen;
    joint.base = null;
    return state.say(joint.crank ? `${joint.name} turns with the drive; with Alt it changes lengths.` : `${joint.name} is on its path: lengths stay. Off it, or with Alt, they change.`);
  }
  if (apart()) return;
  if (!joint.base) Object.assign(joint, { base: present(), index: state.index.value });
  joint.to = at.map((value) => onGrid(value, gridStep(scale) / 10));
  joint.keep = !alt && !joint.sketched;
  joint.drop = joint.sketched && !alt ? dropAt(joint, at) : null;
  if (joint.sketched) {
    if (joint.drop) joint.to = joint.drop.at;
    state.dropping.value = joint.drop;
    state.say(joint.drop ? `Let it go: it is joined with ${joint.drop.on ?? joint.drop.name}. With Alt it is not.` : "");
    state.places.value = { ...state.places.value, ...Object.fromEntries(joint.together.map((key) => [key, joint.to])) };
    return;
  }
  joint.asked = joint.ask(joint.to);
}

/** Show the mechanism with a joint at a place, as it was found. */
function follow(joint, found, to) {
  if (joint.posed || joint.left) return;
  if (found.error) return state.say(found.error, true);
  joint.told = wordsOf(found);
  batch(() => {
    state.live.value = { ...found, to };
    state.selection.value = joint.chosen; // not before: what is laid over a chosen point is asked for when nothing is dragged
    state.index.value = found.index;
    state.say(joint.told);
  });
}

function wordsOf({ changes }) {
  return changes.map(([name, from, to]) => `${name} ${from} → ${to}`).join(", ");
}

async function release(held, shift) {
  if (!held.moved) return tap(held, shift);
  if (held.group) {
    await held.group.drop();
    if (state.tool.value === "box") choose("select");
    return held.group.leave();
  }
  if (held.centre) return void held.centre.drop();
  if (!held.joint) return;
  await held.joint.asked;
  const { name, index, base, sketched, to, told, keep, posed } = held.joint;
  state.dropping.value = null;
  if (posed || !to) return;
  if (sketched) state.places.value = base.places; // `edit` moves them
  if (held.joint.drop) return void edit([{ do: "join", ends: [name, endOf(held.joint.drop)] }], null, base.places);
  if ((await edit([{ do: "move", point: name, to, index, keep }], null, base.places)) && told) state.say(`Move ${name}: ${told}.`);
}

function tap({ spot, part, panning }, shift) {
  if (panning) return;
  if (state.tool.value !== "select") return click(spot, { shift, part });
  if (shift && part?.kind === "links") return toggleLink(part.name);
  state.group.value = [];
  if (part?.kind === "others") return takeOther(part.name);
  state.selection.value = chosenOf(part);
  if (part) state.tab.value = state.tab.value === "plots" ? "plots" : "properties";
}
