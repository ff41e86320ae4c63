// What the keys do, as a list.

import { TOOLS } from "./tools.js";
import { html } from "./ui.js";

/** @type {[string, string[][]][]} */
const KEYS = [
  ["Tools", TOOLS.map(({ key, label }) => [key, label])],
  [
    "On the sheet (Tab brings it, its links and joints into focus)",
    [
      ["← → ↑ ↓", "move the cross by a step of the grid, with Shift ten, with Alt a tenth; a joint in focus moves"],
      ["Enter", "use the tool at the cross, joint or link; with Select, open its properties"],
      ["Shift Enter", "draw an end and pin it to the ground"],
      ["0–9 …", "while drawing: a length, angle, force or ratio, then Enter"],
      ["Delete", "delete what is chosen"],
      ["Menu, Shift F10", "what can be done with the joint, the link or the place"],
      ["Ctrl A, Shift click", "choose all links, or one more; arrows move them"],
      ["Ctrl D", "copy what is chosen"],
      ["Escape", "leave off what was begun"],
    ],
  ],
  ["In space (Tab goes through joints, points and links)", [["Enter", "choose it and open its properties"], ["← → ↑ ↓", "move a joint along the axes nearest to them, with Shift ten steps, with Alt a tenth"], ["Page Up, Page Down", "move it away or nearer"]]],
  ["Motion", [["Space", "play or pause"], [", .", "one position back or on; ← → on a curve, with Shift ten"]]],
  ["View", [["+ −", "zoom"], ["0", "show all"]]],
  ["Everywhere", [["Ctrl Z, Ctrl Shift Z", "undo, redo"], ["Ctrl S, Ctrl O", "save, open"], ["↓ ↑", "go through an open menu"], ["?", "this list"]]],
]; // prettier-ignore

export function Keys() {
  return html`<h2>Keys</h2>
    <div class="key-list">${KEYS.map(
      ([title, rows]) => html`<section><h3>${title}</h3><dl>${rows.map(([keys, does]) => html`<dt><kbd>${keys}</kbd></dt><dd>${does}</dd>`)}</dl></section>`,
    )}</div>`;
}
