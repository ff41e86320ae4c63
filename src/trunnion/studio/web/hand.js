// The pointer on the sheet: click, drag a joint, pan, zoom, also by two fingers. One question to Python at a time while a joint is dragged.

import { drag, edit, present } from "./actions.js";
import { gridStep, onGrid } from "./geometry.js";
import { takeOther } from "./ghosts.js";
import { sheet, shown } from "./sheet.js";
import * as state from "./state.js";
import { click, pointer, toolOf } from "./tools.js";

const STILL = 3; // px that a click may move

/** Listen to the pointer; returns what ends it. */
export function listenToPointer(root, view) {
  const hand = { held: null };
  const fingers = new Map(); // where they are, px, by pointer
  const placed = (event) => {
    const box = root.getBoundingClientRect();
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
    root.setPointerCapture(event.pointerId);
    hand.held = { start: placed(event), last: placed(event), spot, part, panning, moved: false };
  });
  root.addEventListener("pointermove", (event) => {
    if (fingers.size > 1 && fingers.has(event.pointerId)) return spread(fingers, event.pointerId, placed(event));
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, placed(event));
    follow(event);
    if (hand.held) pull(view, hand.held, placed(event));
  });
  root.addEventListener("pointerup", (event) => {
    fingers.delete(event.pointerId);
    const { held } = hand;
    hand.held = null;
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

/** Leave off what is held, as if it had never been taken. */
function letGo(hand) {
  const { joint } = hand.held ?? {};
  hand.held = null;
  state.live.value = null;
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

/** What a pointer is over: {kind, name, key}, or null. */
export function partUnder(target) {
  const node = target?.closest?.("[data-kind]");
  return node ? { kind: node.dataset.kind, name: node.dataset.name, key: node.dataset.key } : null;
}

function pull(view, held, at) {
  const far = Math.hypot(at[0] - held.start[0], at[1] - held.start[1]);
  if (!held.moved && far <= STILL) return;
  if (!held.moved) takeHold(view, held);
  held.moved = true;
  if (held.joint) dragTo(held.joint, view.frame.from(at), gridStep(view.frame.scale) / 10);
  else if (!held.locked && (held.panning || state.tool.value === "select")) sheet.pan(at[0] - held.last[0], at[1] - held.last[1]);
  held.last = at;
}

function takeHold(view, held) {
  const { kind, name, key } = held.part ?? {};
  if (held.panning || state.tool.value !== "select" || (kind !== "joints" && kind !== "points")) return;
  if (state.locked.value.includes(name)) {
    held.locked = true;
    return state.say(`${name} is locked where it is; unlock it first (K).`, true);
  }
  const base = present();
  const { sketched } = shown.peek();
  held.joint = { name, key, index: view.posed, asked: false, wanted: null, sketched, base, together: sketched ? together(kind, name, base.places) : [] };
  state.selection.value = { kind, name };
}

/** The points that lie in one joint, of a mechanism that is only drawn yet. */
function together(kind, name, places) {
  return kind === "joints" ? Object.keys(places).filter((key) => key.endsWith(`.${name}`)) : [name];
}

function dragTo(joint, at, fine) {
  joint.to = at.map((value) => onGrid(value, fine));
  if (joint.sketched) {
    state.places.value = { ...state.places.value, ...Object.fromEntries(joint.together.map((key) => [key, joint.to])) };
    return;
  }
  joint.wanted = joint.to;
  if (!joint.asked) joint.asked = follow(joint);
}

/** Ask for the mechanism at the latest place until the hand rests. */
async function follow(joint) {
  while (joint.wanted) {
    const to = joint.wanted;
    joint.wanted = null;
    const found = await drag({ point: joint.name, index: joint.index, to });
    if (!found) break;
    if (found.error) state.say(found.error, true);
    else if (found.points && !joint.left) {
      state.live.value = { ...found, to };
      if (found.solved) state.index.value = found.index;
      state.say(wordsOf(found), !found.solved);
    }
  }
  joint.asked = false;
}

function wordsOf({ solved, changes }) {
  const told = (changes ?? []).map(([name, from, to]) => `${name} ${from} → ${to}`).join(", ");
  return solved ? told : `${told}${told ? ": " : ""}it cannot be assembled so.`;
}

async function release(held, shift) {
  if (!held.moved) return tap(held, shift);
  if (!held.joint) return;
  const { name, index, base, sketched, to } = held.joint;
  await held.joint.asked;
  if (sketched) state.places.value = base.places; // `edit` moves them
  await edit([{ do: "move", point: name, to, index }]);
}

function tap({ spot, part, panning }, shift) {
  if (panning) return;
  if (state.tool.value !== "select") return click(spot, { shift, part });
  if (part?.kind === "others") return takeOther(part.name);
  state.selection.value = part && { kind: part.kind, name: part.name };
  if (part) state.tab.value = state.tab.value === "plots" ? "plots" : "properties";
}
