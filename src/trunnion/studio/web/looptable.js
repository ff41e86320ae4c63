// The dual Denavit–Hartenberg table of a loop in space, its cells typed in place; the picture follows.

import { edit, setValue } from "./actions.js";
import { ambiguous, bare, findingsOf, numberOf, usualUnit, written } from "./fields.js";
import * as state from "./state.js";
import { removePart } from "./tools.js";
import { Button, html } from "./ui.js";

/** What a loop in space begins with: four joints, the two shafts at 30°. */
export const LOOP = `trunnion: 1
name: Loop in space
space: spatial

loop:                                # a joint, then the link after it: its twist and distance lead to the next axis
  - {joint: A, type: revolute, link: link1, twist: 90 deg, distance: 0 mm}
  - {joint: B, type: cylindrical, link: link2, twist: 90 deg, distance: 0 mm}
  - {joint: C, type: cylindrical, link: link3, twist: 90 deg, distance: 0 mm}
  - {joint: D, type: cylindrical, link: ground, twist: 150 deg, distance: 0 mm}

drivers:
  A: {speed: 60 rpm}
`;

const TYPES = ["revolute", "cylindrical", "prismatic", "helical"];
/** Along and about the joint's axis, then along and about the common normal to the next: key of the file, label, unit. */
const CELLS = [["rotation", "angle θ", "deg"], ["slide", "offset s", ""], ["distance", "length a", ""], ["twist", "twist α", "deg"]]; // prettier-ignore
/** What a joint of a type does itself: that is no number of the table. */
const MOVES = { revolute: ["rotation"], prismatic: ["slide"], cylindrical: ["rotation", "slide"], helical: ["rotation", "slide"] };

export function LoopTable({ entries, findings }) {
  const rows = entries?.loop;
  if (!Array.isArray(rows)) return null;
  return html`<section class="loop"><h2>Table of the loop</h2>
    <p class="calm">A joint turns and slides about its axis by θ and s; the link after it leads over the common normal, by a and α, to the axis of the next.</p>
    <table><thead><tr><th scope="col">joint, link</th>${CELLS.map(([, label]) => html`<th scope="col">${label}</th>`)}</tr></thead>
      <tbody>${rows.map((row, at) => html`<${Row} key=${at} row=${row ?? {}} at=${at} findings=${findings} entries=${entries} last=${rows.length < 3} />`)}</tbody></table>
    ${findingsOf(findings, ["loop"]).filter(({ severity }) => severity === "error").map(({ what, remedy }) => html`<p class="wrong">${what}${remedy ? ` — ${remedy}` : ""}</p>`)}
    <p class="row-of-buttons"><${Button} label="Add a joint" title="A joint and a link before the ground" onClick=${() => edit([{ do: "add-row" }])} /></p></section>`; // prettier-ignore
}

function Row({ row, at, findings, entries, last }) {
  const type = ({ target }) => edit([{ do: "set", path: ["loop", at, "type"], value: target.value }, ...(MOVES[target.value] ?? []).map((key) => ({ do: "set", path: ["loop", at, key], value: null }))]); // prettier-ignore
  const rename = (key) => async ({ target }) => {
    if (!(await edit([{ do: "rename", what: [`${key}s`, row[key]], to: target.value }]))) target.value = row[key];
  };
  const names = html`<td><span class="of-row">
    ${["joint", "link"].map((key) => html`<input aria-label=${`${key} of row ${at + 1}`} value=${row[key] ?? ""} onChange=${rename(key)} spellcheck=${false} />`)}
    <select aria-label=${`type of ${row.joint}`} value=${row.type} onChange=${type}>${[...new Set([...TYPES, row.type])].map((one) => html`<option value=${one}>${one}</option>`)}</select>
    <span class="row-of-buttons"><button type="button" class="link" onClick=${() => (state.selection.value = { kind: "joints", name: row.joint })}>choose</button>
    ${!last && html`<button type="button" class="link" aria-label=${`Delete row ${row.joint}`} onClick=${() => removePart({ kind: "joints", name: row.joint })}>delete</button>`}</span></span></td>`; // prettier-ignore
  return html`<tr>${names}${CELLS.map(([key, label, angle]) => html`<td><${Cell} row=${row} at=${at} name=${key} label=${label} unit=${angle || usualUnit(entries)} findings=${findings} /></td>`)}</tr>`;
}

function Cell({ row, at, name, label, unit, findings }) {
  if (MOVES[row.type]?.includes(name)) return html`<span class="calm" title="The joint itself moves so">moves</span>`;
  const value = row[name] === undefined || row[name] === null ? "" : String(row[name]);
  const wrong = findingsOf(findings, ["loop", row.joint, name]).filter(({ severity }) => severity !== "note");
  const take = async ({ target }) => {
    const own = ambiguous(target.value) ? null : written(target.value, unitOf(value, unit));
    if (own === null && target.value.trim()) state.say(`“${target.value}” may be a thousand or a decimal.`, true);
    else if (await setValue(["loop", at, name], own)) return;
    target.value = value;
  };
  return html`<input aria-label=${`${label} of ${row.joint}`} value=${value} placeholder="0" aria-invalid=${wrong.length > 0} title=${wrong.map(({ what }) => what).join("; ") || `A number alone is in ${unitOf(value, unit)}`} onChange=${take} spellcheck=${false} />`; // prettier-ignore
}

/** The unit that a number alone takes: that of what was there, or the usual one. */
const unitOf = (value, usual) => (bare(value) ? "" : numberOf(value)?.rest.split("±")[0].trim()) || usual;
