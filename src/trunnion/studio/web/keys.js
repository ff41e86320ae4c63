// The keyboard alone can do all that the mouse can: a cross on the sheet, joints moved by arrows, a letter for each tool.

import { place } from "../web/data.js";
import * as actions from "./actions.js";
import { crank } from "./motion.js";
import { allLinks, chooseLinks, chosenLinks, groupActions, shift } from "./group.js";
import { chosenOf, massSpots } from "./masses.js";
import { openByKey } from "./menu.js";
import { partUnder, partsAt, sheet, shown } from "./sheet.js";
import * as state from "./state.js";
import { TOOLS, cancel, choose, click, placeTyped, pointer, removePart, toolOf, typed } from "./tools.js";
import { focusOn } from "./ui.js";

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const WRITES = "input:not([type=range]), textarea, select, dialog, [contenteditable]";

/** The field whose letters are not taken over yet. */
let letters = null;

export function listenToKeys(target) {
  target.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.isComposing) return;
    if (state.dialog.value && !event.target.closest?.("dialog")) return; // Escape closes the dialog
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
  else if (key === "a" && free(event.target)) return chooseAll();
  else if (key === "d" && free(event.target) && copied()) return act(copied()[2]);
  else if (key === "a" && !event.target.closest?.(WRITES)) return true; // or it would mark the whole page
  else return false;
  return true;
}

const onSheet = (target) => !state.spatial.value && sheet.view?.root.contains(target);
const free = (target) => onSheet(target) || (target === document.body && !state.spatial.value && sheet.view);

function chooseAll() {
  chooseLinks(allLinks());
  return true;
}

/** The action that copies what is chosen. */
function copied() {
  const { kind, name } = state.selection.value ?? {};
  const names = chosenLinks().length ? chosenLinks() : kind === "links" ? [name] : [];
  return names.length ? groupActions(names).find(([label]) => label === "Copy") : null;
}

/** Whether the key was one of ours. */
function ordinary(event) {
  const { target, key } = event;
  const chooses = key === "Escape" && state.tool.value !== "select" && target.matches?.("select") && !target.closest("dialog");
  if (event.ctrlKey || event.metaKey || (target.closest?.(WRITES) && !chooses)) return false;
  if (value(event)) return true;
  if ((key === "ContextMenu" || (key === "F10" && event.shiftKey)) && onSheet(target)) return act(() => openByKey(target, pointer.value?.keyboard ? pointer.value.spot.at : null));
  if (onSheet(target) && (key in ARROWS || key === "Enter")) return key === "Enter" ? enter(event) : arrow(event);
  if (key === "Escape") return leave(target);
  if ((key === "Delete" || key === "Backspace") && chosenLinks().length) return act(groupActions(chosenLinks()).at(-1)[2]);
  if ((key === "Delete" || key === "Backspace") && state.selection.value) return removeChosen();
  if (key === " " && !target.closest?.("button, summary, a, [role=tab]")) return act(() => crank.toggle());
  if (key === "?") return act(() => (state.dialog.value = "keys"));
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

const EXAMPLES = { link: "no length; type one as 60, 60 mm or 2.5 in", slide: "no angle; type one as 30", load: "no force; type one as 250, 250 N or 2 kN" };

/** Letters of a value that is typed while something is drawn. */
function value(event) {
  const { key, shiftKey } = event;
  const { id, begins } = toolOf();
  if (!state.pending.value || !begins || (key.length > 1 && key !== "Enter" && key !== "Backspace")) return false;
  const letters = typed.value;
  if (key === "Enter") {
    if (!letters) return false;
    if (!placeTyped(shiftKey)) state.say(`“${letters}” is ${EXAMPLES[id]}.`, true);
    return true;
  }
  if (key === "Backspace") return Boolean(letters) && act(() => (typed.value = letters.slice(0, -1)));
  if (begins.test(key) || (letters && /[0-9.,a-zµ° :/-]/i.test(key))) return act(() => (typed.value = letters + key));
  return false;
}

/** Arrows: one step of the grid, with Shift ten, with Alt a tenth. */
function arrow({ target, key, shiftKey, altKey }) {
  const step = sheet.step() * (shiftKey ? 10 : altKey ? 0.1 : 1);
  const [dx, dy] = ARROWS[key].map((part) => part * step);
  const part = partUnder(target);
  if (!part && state.tool.value === "select" && chosenLinks().length) return act(() => shift([dx, dy], "shift links"));
  const moved = ([x, y]) => [x + dx, y + dy].map((value) => Number(value.toPrecision(12)));
  const held = part && [...sheet.spots(), ...massSpots(sheet.view)].find(({ kind, name }) => kind === part.kind && name === part.name);
  if (held && state.tool.value === "select") return act(() => nudge(part, moved(held.at)));
  if (held) sheet.view.root.focus(); // the cross leaves the joint, and Enter is for where it is
  const from = held?.at ?? pointer.value?.spot.at ?? sheet.view.frame.from([sheet.view.frame.width / 2, sheet.view.frame.height / 2]);
  const near = 0.45 * step; // nearer than a step, or the cross could not leave a joint
  const cross = altKey ? moved(from) : moved(sheet.snap(from, false, Math.min(near, 0.45 * sheet.step())).at);
  pointer.value = { spot: sheet.snapOn(cross, altKey, linkUnder(cross), near), keyboard: true, ...sheet.scale() };
  const { at, name, on } = pointer.value.spot;
  state.say(name || on ? `At ${name ?? on}.` : `At ${at.map((value) => `${Number((1000 * value).toPrecision(6))} mm`).join(", ")}.`);
  return true;
}

function nudge({ kind, name }, at) {
  if (kind === "centres") return void actions.edit([{ do: "centre", link: name, at }], `nudge ${name}`);
  state.selection.value = { kind, name };
  actions.edit([{ do: "move", point: name, to: at, index: sheet.view.posed, keep: !shown.peek()?.sketched }], `nudge ${name}`);
}

/** Enter: the tool at the cross or at the joint in focus; with no tool, the properties of it. */
function enter({ target, shiftKey: shift }) {
  const part = partUnder(target);
  if (part && state.tool.value === "select") {
    state.selection.value = chosenOf(part);
    state.tab.value = "properties";
    requestAnimationFrame(() => focusOn(".properties input"));
    return true;
  }
  const spot = (part && sheet.spots().find(({ kind, name }) => kind === part.kind && name === part.name)) ?? (part?.kind === "links" ? middleOf(part) : crossed());
  if (!spot) return true;
  const under = part?.kind === "links" ? [part] : partsAt(spot.at);
  const link = under.find(({ kind }) => kind === "links");
  click(spot, { shift, part: link ?? under[0] ?? null });
  return true;
}

/** The middle of a link in focus, as a spot on it. */
function middleOf(part) {
  const { scene, posed } = sheet.view;
  const spots = scene.links.find(({ name }) => name === part.name).points.map((key) => place(scene, key, posed)).filter(Boolean);
  const middle = [0, 1].map((axis) => spots.reduce((sum, spot) => sum + spot[axis], 0) / spots.length);
  return { ...sheet.snapOn(middle, true, part, 0), at: middle };
}

/** What the cross is at by now. */
function crossed() {
  const { at } = pointer.value?.spot ?? {};
  return at && sheet.snapOn(at, true, linkUnder(at), 0.45 * sheet.step());
}

const linkUnder = (at) => (toolOf().on ? partsAt(at).find(({ kind }) => kind === "links") : null);

/** Escape: moves by arrows are taken back, else what was begun is left off. */
function leave(target) {
  const last = state.past.value[state.past.value.length - 1];
  if (last?.merge === "shift links" && chosenLinks().length) actions.undo();
  else if (last?.merge && last.merge === `nudge ${partUnder(target)?.name}`) actions.undo();
  else cancel();
  return true;
}

function removeChosen() {
  removePart(state.selection.value);
  return true;
}
