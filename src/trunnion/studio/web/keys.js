// The keyboard alone can do all that the mouse can: a cross on the sheet, joints moved by arrows, a letter for each tool.

import * as actions from "./actions.js";
import { partUnder } from "./hand.js";
import { crank } from "./motion.js";
import { sheet } from "./sheet.js";
import * as state from "./state.js";
import { TOOLS, cancel, choose, click, placeTyped, pointer, removePart, typedLength } from "./tools.js";

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const WRITES = "input:not([type=range]), textarea, select, dialog, [contenteditable]";

/** The field whose letters are not taken over yet. */
let letters = null;

export function listenToKeys(target) {
  target.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.isComposing) return;
    if (withControl(event) || ordinary(event)) event.preventDefault();
  });
  target.addEventListener("focusout", () => state.settle());
  target.addEventListener("input", (event) => (letters = event.target)); // not taken over yet
  for (const kind of ["change", "focusout"]) target.addEventListener(kind, () => (letters = null));
}

function withControl(event) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return false;
  const key = event.key.toLowerCase();
  const writes = event.target === letters && event.target.matches("input:not([type=range])"); // undoes its own letters
  if (key === "s") actions.save();
  else if (key === "o") state.dialog.value = "open";
  else if (key === "z" && !writes) event.shiftKey ? actions.redo() : actions.undo();
  else if (key === "y" && !writes) actions.redo();
  else return false;
  return true;
}

/** Whether the key was one of ours. */
function ordinary(event) {
  const { target, key } = event;
  if (event.ctrlKey || event.metaKey || target.closest?.(WRITES)) return false;
  if (length(event)) return true;
  const onSheet = sheet.view?.root.contains(target);
  if (onSheet && (key in ARROWS || key === "Enter")) return key === "Enter" ? enter(event) : arrow(event);
  if (key === "Escape") return leave(target);
  if ((key === "Delete" || key === "Backspace") && state.selection.value) return removeChosen();
  if (key === " " && !target.closest?.("button, summary, a, [role=tab]")) return act(() => crank.toggle());
  if (target.closest?.("input, button, [role=tab]")) return false;
  if (key === "," || key === ".") return act(() => crank.go(state.index.value + (key === "." ? 1 : -1)));
  if (key === "0") return act(() => sheet.view && sheet.fit());
  if (key === "+" || key === "-") return act(() => sheet.view && sheet.zoom(key === "+" ? 1.25 : 0.8));
  const found = TOOLS.find((one) => one.key === key.toUpperCase());
  return Boolean(found && !event.altKey && !state.spatial.value && act(() => choose(found.id)));
}

function act(does) {
  does();
  return true;
}

/** Letters of a typed length while a link is drawn. */
function length(event) {
  const { key, shiftKey } = event;
  if (!state.pending.value || state.tool.value !== "link") return false;
  const typed = typedLength.value;
  if (key === "Enter" && typed) {
    if (!placeTyped(shiftKey)) state.say(`“${typed}” is no length; type one as 60, 60 mm or 2.5 in.`, true);
    return true;
  }
  if (key === "Backspace" && typed) return act(() => (typedLength.value = typed.slice(0, -1)));
  if (/^[0-9.,]$/.test(key) || (typed && /^[a-zµ ]$/i.test(key))) return act(() => (typedLength.value = typed + key));
  return false;
}

/** Arrows: one step of the grid, with Shift ten, with Alt a tenth. */
function arrow({ target, key, shiftKey, altKey }) {
  const step = sheet.step() * (shiftKey ? 10 : altKey ? 0.1 : 1);
  const [dx, dy] = ARROWS[key].map((part) => part * step);
  const part = partUnder(target);
  const moved = ([x, y]) => [x + dx, y + dy].map((value) => Number(value.toPrecision(12)));
  if (part && state.tool.value === "select") {
    const spot = sheet.spots().find(({ kind, name }) => kind === part.kind && name === part.name);
    if (spot) nudge(part, moved(spot.at));
    return true;
  }
  const from = pointer.value?.spot.at ?? sheet.view.frame.from([sheet.view.frame.width / 2, sheet.view.frame.height / 2]);
  const cross = altKey ? moved(from) : moved(sheet.snap(from).at);
  pointer.value = { spot: sheet.snap(cross, altKey), keyboard: true, wide: sheet.view.frame.width / sheet.view.frame.scale };
  const { at, name } = pointer.value.spot;
  state.say(name ? `At ${name}.` : `At ${at.map((value) => `${Number((1000 * value).toPrecision(6))} mm`).join(", ")}.`);
  return true;
}

function nudge({ kind, name }, at) {
  state.selection.value = { kind, name };
  actions.edit([{ do: "move", point: name, to: at, index: sheet.view.posed }], `nudge ${name}`);
}

/** Enter: the tool at the cross or at the joint in focus; with no tool, the properties of it. */
function enter({ target, shiftKey: shift }) {
  const part = partUnder(target);
  if (part && state.tool.value === "select") {
    state.selection.value = part;
    state.tab.value = "properties";
    requestAnimationFrame(() => document.querySelector(".properties input")?.focus());
    return true;
  }
  const spot = part ? sheet.spots().find(({ kind, name }) => kind === part.kind && name === part.name) : pointer.value && sheet.snap(pointer.value.spot.at, true);
  if (!spot) return true;
  const [x, y] = sheet.view.frame.to(spot.at);
  const box = sheet.view.root.getBoundingClientRect();
  const under = document.elementsFromPoint(x + box.left, y + box.top).map(partUnder);
  click(spot, { shift, part: under.find((one) => one?.kind === "links") ?? under.find(Boolean) ?? null });
  return true;
}

/** Escape: moves by arrows are taken back, else what was begun is left off. */
function leave(target) {
  const last = state.past.value[state.past.value.length - 1];
  if (last?.merge && last.merge === `nudge ${partUnder(target)?.name}`) actions.undo();
  else cancel();
  return true;
}

function removeChosen() {
  removePart(state.selection.value);
  return true;
}
