// Values of what is chosen, as the file writes them, typed in place; the list of parts; dimensions with sliders.

import { useRef, useState } from "preact/hooks";
import { arrow } from "../web/arrow.js";
import { at, full, peak } from "../web/data.js";
import { quantity, short } from "../web/format.js";
import { changed, edit, newest, setValue } from "./actions.js";
import { ambiguous, bare, findingsOf, numberOf, partOfList, rowsOf, unitOf, usualUnit, written } from "./fields.js";
import { dictionary, groundOf } from "./geometry.js";
import { others, takeOther } from "./ghosts.js";
import { BarMass, Gravity, Masses } from "./masses.js";
import * as state from "./state.js";
import { removePart } from "./tools.js";
import { Button, focusOn, html } from "./ui.js";

const NOUNS = { links: "Link", joints: "Joint", points: "Point", drivers: "Driver", loads: "Load", springs: "Spring", gears: "Gear pair" };
const SECTIONS = ["links", "joints", "drivers", "loads", "springs", "gears"];
const MANY_WAYS = new Set(["spherical", "universal", "planar", "fixed"]); // joints whose motion is not along or about one axis
const MOST = 300; // parts in a list
const ROOMY = 9; // letters that every field has room for
const LONG = 26; // that none has

export function Properties() {
  const chosen = state.selection.value;
  return html`<div class="properties">
    ${chosen ? html`<${Chosen} key=${`${chosen.kind} ${chosen.name}`} ...${chosen} />` : html`<${Model} />`}
  </div>`;
}

function Chosen({ kind, name }) {
  const { entries, findings } = state.answer.value ?? {};
  const [link, point] = kind === "points" ? [name.split(".")[0], name.split(".").slice(1).join(".")] : [];
  const rows = kind === "points" ? rowsOf(entries, "links", link).filter(({ path }) => path[2] === "points" && path[3] === point) : rowsOf(entries, kind, name);
  const driver = kind === "joints" && dictionary(entries?.drivers)[name] !== undefined;
  return html`<section>
      <h2 class="of-part">
        ${NOUNS[kind]}
        <${Name} kind=${kind} name=${name} />
      </h2>
      <${Rows} rows=${rows} findings=${findings} />
      ${kind === "joints" && state.solved.value && html`<p class="calm">${arrowOf(state.answer.value.scene.joints.find((one) => one.name === name))}</p>`}
      ${kind === "joints" && html`<${Sections} joint=${name} />`}
      ${kind === "links" && name !== groundOf(entries) && !state.spatial.value && html`<${BarMass} links=${[name]} /><${Gravity} />`}
      ${driver && html`<h3>Driver</h3><${Rows} rows=${rowsOf(entries, "drivers", name)} findings=${findings} />`}
      <p class="row-of-buttons">
        ${kind === "joints" && !driver && html`<${Button} label="Drive this joint" onClick=${() => edit([{ do: "driver", joint: name }])} />`}
        ${kind === "joints" && !MANY_WAYS.has(entries?.joints?.[name]?.type) && html`<${Button} label="Load against its motion" onClick=${() => edit([{ do: "load", against: name }])} />`}
        ${kind === "points" && !state.spatial.value && html`<${Button} label="Pin to the ground" onClick=${() => edit([{ do: "pin", point: name }])} />`}
        ${!(kind === "links" && name === groundOf(entries)) && html`<${Button} label=${`Delete ${NOUNS[kind].toLowerCase()}`} onClick=${() => removePart({ kind, name })} />`}
        <${Button} label="All parts" onClick=${() => (state.selection.value = null)} />
      </p>
    </section>`; // prettier-ignore
}

/** What the arrow at a joint is. */
function arrowOf(joint) {
  if (!joint) return null;
  const { type, links: [first, second] } = joint; // prettier-ignore
  return `Its arrow is the force on ${second} by ${first}${type === "prismatic" ? ", the friction along the guide included" : ""}.`;
}

function Name({ kind, name }) {
  const owner = kind === "points" ? `${name.split(".")[0]}.` : "";
  const shown = name.slice(owner.length);
  const take = async ({ target }) => {
    const to = target.value.trim();
    if (to === shown || !to) return void (target.value = shown);
    if (await edit([{ do: "rename", what: [kind, name], to }])) state.selection.value = { kind, name: `${owner}${to}` };
    else target.value = shown;
  };
  return html`<input class="name-of-part" aria-label="Name" value=${shown} onChange=${take} />`;
}

function Rows({ rows, findings }) {
  return html`<div class="rows">${rows.map((row) => html`<${Row} key=${row.path.join(".")} row=${row} findings=${findings} />`)}</div>`;
}

/** Units that fields had when what was in them was sound, by path: a bare number takes them. */
const units = new Map();

/** A value, or the parts of a list, with what is wrong about it. */
function Row({ row, findings }) {
  const { path, label, value, example, fixed, common, choices } = row;
  const wrong = findingsOf(findings, row.where ?? path).filter(({ severity }) => severity !== "note");
  const id = `value-${path.join("-")}`;
  const list = Array.isArray(value ?? example);
  if (fixed) return html`<div class="row"><span class="label" title=${path.join(".")}>${label}</span><span class="fixed">${list ? value.join(", ") : value}</span></div>`;
  if (choices)
    return html`<div class="row"><label class="label" for=${`${id}-0`}>${label}</label><span class="values">
      <select id=${`${id}-0`} value=${value ?? ""} onChange=${({ target }) => setValue(path, { "": null, true: true, false: false }[target.value] ?? (target.value || null))}>
        ${Object.entries({ ...choices, ...(value && !(value in choices) && { [value]: value }) }).map(([one, words]) => html`<option value=${one}>${words}</option>`)}
      </select></span></div>`; // prettier-ignore
  const parts = list ? (value ?? example.map(() => "")) : [value ?? ""];
  if (!wrong.length) parts.forEach((_, order) => unitOf(row, order) && units.set(`${id}-${order}`, unitOf(row, order)));
  const put = (order) => async ({ target }) => {
    const why = refusal(row, target.value, units.get(`${id}-${order}`));
    if (why) state.say(why, true);
    if (why || !(await take(row, parts, list, order, target.value, units.get(`${id}-${order}`)))) target.value = parts[order];
  };
  return html`<div class="row">
    <label class="label" for=${`${id}-0`} title=${`In the file: ${path.join(".")}`}>${label}</label>
    <span class="values">
      ${parts.map((one, order) => html`<input key=${order} id=${`${id}-${order}`} value=${one} style=${`--wide: ${String(one).length > ROOMY ? String(one).length + 3 : 0}ch`} placeholder=${common ? `${common}, as all joints` : example && `e.g. ${list ? example[order] : example}`}
        aria-label=${list ? `${label}, ${partOfList(path, order)}` : label} aria-invalid=${wrong.length > 0} title=${String(one).length > LONG ? one : hintOf(units.get(`${id}-${order}`))}
        aria-describedby=${wrong.length ? `${id}-wrong` : null} onChange=${put(order)} spellcheck=${false} />`)}
    </span>
    ${wrong.length > 0 && html`<p class="wrong" id=${`${id}-wrong`}>${wrong.map(({ what, remedy }) => `${what}${remedy ? ` — ${remedy}` : ""}`).join("; ")}</p>`}
  </div>`; // prettier-ignore
}

const hintOf = (unit) => (unit ? `A number alone is in ${unit}` : null);

/** Why typed letters are not taken; nothing where they are. */
function refusal({ path, value }, typed, unit) {
  if (ambiguous(typed)) return `“${typed.trim()}” may be a thousand or a decimal: write ${typed.trim().replace(",", "")} or ${typed.trim().replace(",", ".")}.`;
  const formula = typeof value === "string" && value !== "" && !numberOf(value);
  if (path[0] === "dimensions" && !unit && formula && bare(typed)) return `“${typed.trim()}” of what? Write its unit, as in ${typed.trim()} mm.`;
  return null;
}

function take({ path, example }, parts, list, order, typed, unit) {
  const length = path[2] === "points" && path[path.length - 1] !== "axis";
  const own = written(typed, unit ?? (length && !numberOf(parts[order]) ? usualUnit(state.answer.value?.entries) : ""));
  if (!list) return setValue(path, own);
  const next = parts.map((one, place) => (place === order ? own : written(one)));
  if (next.every((one) => one === null)) return setValue(path, null);
  return setValue(path, next.map((one, place) => one ?? written(String(example?.[place] ?? "0"))));
}

/** What belongs to no part, the dimensions, and a list of all parts. */
function Model() {
  const { entries, findings } = state.answer.value ?? {};
  const dimensions = Object.entries(dictionary(entries?.dimensions));
  return html`<${LoopTable} entries=${entries} findings=${findings} />
    <section><h2>Model</h2><${Rows} rows=${rowsOf(entries, "model")} findings=${findings} /></section>
    <section><h2>Dimensions</h2><div class="rows">
      ${dimensions.map(([name, value]) => html`<${Dimension} key=${name} name=${name} value=${value} findings=${findings} />`)}
    </div><${AddDimension} /></section>
    <${Masses} />
    <section><h2>Parts</h2>${SECTIONS.map((kind) => html`<${Parts} kind=${kind} names=${Object.keys(dictionary(entries?.[kind]))} />`)}</section>
    ${others.value.length > 0 && html`<section><h2>Other assemblies</h2><p class="row-of-buttons">
      ${others.value.map(({ name }) => html`<${Button} label=${`Take ${name}`} onClick=${() => takeOther(name)} />`)}</p></section>`}`; // prettier-ignore
}

function Parts({ kind, names }) {
  if (!names.length) return null;
  return html`<div class="parts">
    <span class="label">${NOUNS[kind]}s</span>
    <span class="row-of-buttons">
      ${names.slice(0, MOST).map((name) => html`<button type="button" class="plain" onClick=${() => (state.selection.value = { kind, name })}>${name}</button>`)}
      ${names.length > MOST && `and ${names.length - MOST} more`}
    </span>
  </div>`;
}

/** A dimension of the present text that is so many times as long, SI. */
function dimensionTimes(name, times) {
  const { text, numbers } = state.answer.value;
  const path = `dimensions.${name}`;
  return { text, path, value: times * numbers[path] };
}

/** Show the mechanism with a number that was tried, unless the text has changed since. */
function showTried(found, text) {
  if (text !== state.text.value) return;
  if (found.error) state.say(found.error, true);
  else state.live.value = found;
}

/** A dimension with a slider from none to twice of it; all that one pull of the slider changes is one step. */
function Dimension({ name, value, findings }) {
  const path = ["dimensions", name];
  const number = numberOf(value);
  const [pulled, setPulled] = useState(null);
  const start = pulled?.from ?? number;
  const [shown, asked] = [useRef(null), useRef(null)];
  shown.current ??= newest(
    ({ path, value }) => changed("try", { values: { [path]: value }, index: state.index.peek() }),
    (found, { text }) => showTried(found, text),
  );
  const typedBy = ({ target }) => Number(Number(target.value).toPrecision(4));
  const pull = (event) => {
    setPulled({ from: start, text: `${typedBy(event)} ${start.rest}`.trim() });
    if (state.solved.value) asked.current = shown.current(dimensionTimes(name, typedBy(event) / start.value));
  };
  const back = async (event) => {
    if (typedBy(event) !== start.value) return; // it is released elsewhere
    await asked.current;
    state.live.value = null;
    setPulled(null);
  };
  const release = async (event) => {
    await setValue(path, written(`${typedBy(event)} ${start.rest}`.trim()), `slider ${name}`);
    setPulled(null);
  };
  const slides = start && start.value !== 0;
  return html`<div class=${String(value).length > ROOMY ? "dimension long" : "dimension"}>
    <${Row} row=${{ path, label: name, value: pulled?.text ?? String(value), example: null }} findings=${findings} />
    ${slides && html`<input type="range" aria-label=${`${name}, slider`} min=${Math.min(0, 2 * start.value)} max=${Math.max(0, 2 * start.value)}
      step=${Math.abs(start.value) / 200} value=${numberOf(pulled?.text ?? value)?.value} onInput=${pull} onChange=${release} onPointerUp=${back} />`}
  </div>`; // prettier-ignore
}

// ---- a dimension more ----------------------------------------------------------------------------------------------

const NAME = /^[^\W\d]\w*$/u;

/** Fields for a dimension that there is not yet; a definition typed for a number elsewhere makes one too. */
function AddDimension() {
  const add = async (event) => {
    event.preventDefault();
    const form = event.currentTarget;
    const [name, value] = ["name", "value"].map((key) => form.elements[key].value.trim());
    const { entries } = state.answer.value ?? {};
    const why = refused(name, value, dictionary(entries?.dimensions));
    if (why) return state.say(why, true);
    if (await setValue(["dimensions", name], written(value, usualUnit(entries)))) {
      form.reset();
      focusOn(".new-dimension input");
    }
  };
  return html`<form class="new-dimension" aria-label="New dimension" onSubmit=${add}>
    <input name="name" aria-label="Name of the new dimension" placeholder="name" spellcheck=${false} />
    <input name="value" aria-label="Value of the new dimension" placeholder="e.g. 30 mm" spellcheck=${false} />
    <button type="submit" class="plain" title="Then type its name where a number stands; crank = 30 mm typed there makes one, too">Add dimension</button>
  </form>`; // prettier-ignore
}

function refused(name, value, known) {
  if (!NAME.test(name)) return `“${name}” is no name: letters, digits and _, a letter first.`;
  if (name in known) return `There is a dimension ${name} already.`;
  return value ? "" : `What is ${name}? Write its value, such as 30 mm.`;
}

// ---- the table of a loop -------------------------------------------------------------------------------------------

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

function LoopTable({ entries, findings }) {
  const rows = entries?.loop;
  if (!Array.isArray(rows)) return null;
  return html`<section class="loop"><h2>Table of the loop</h2>
    <p class="calm">A joint turns and slides about its axis by θ and s; the link after it leads over the common normal, by a and α, to the axis of the next.</p>
    <table><thead><tr><th scope="col">joint, link</th>${CELLS.map(([, label]) => html`<th scope="col">${label}</th>`)}</tr></thead>
      <tbody>${rows.map((row, at) => html`<${LoopRow} key=${at} row=${row ?? {}} at=${at} findings=${findings} entries=${entries} last=${rows.length < 3} />`)}</tbody></table>
    ${findingsOf(findings, ["loop"]).filter(({ severity }) => severity === "error").map(({ what, remedy }) => html`<p class="wrong">${what}${remedy ? ` — ${remedy}` : ""}</p>`)}
    <p class="row-of-buttons"><${Button} label="Add a joint" title="A joint and a link before the ground" onClick=${() => edit([{ do: "add-row" }])} /></p></section>`; // prettier-ignore
}

function LoopRow({ row, at, findings, entries, last }) {
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
    const own = ambiguous(target.value) ? null : written(target.value, unitOfCell(value, unit));
    if (own === null && target.value.trim()) state.say(`“${target.value}” may be a thousand or a decimal.`, true);
    else if (await setValue(["loop", at, name], own)) return;
    target.value = value;
  };
  return html`<input aria-label=${`${label} of ${row.joint}`} value=${value} placeholder="0" aria-invalid=${wrong.length > 0} title=${wrong.map(({ what }) => what).join("; ") || `A number alone is in ${unitOfCell(value, unit)}`} onChange=${take} spellcheck=${false} />`; // prettier-ignore
}

/** The unit that a number alone takes: that of what was there, or the usual one. */
const unitOfCell = (value, usual) => (bare(value) ? "" : numberOf(value)?.rest.split("±")[0].trim()) || usual;

// ---- sections through pins -----------------------------------------------------------------------------------------

const [WIDE, TALL] = [330, 156]; // px of a section
const [HALF, PLAY, PIN, WALL] = [112, 17, 24, 9]; // px: half the length, the play to either side, half the pin, the wall
const ARROW = 30; // px, of the largest load

/** The sections of a joint with a pin that has two ends in a hole, in z–x and in z–y of the hole; nothing for others. */
function Sections({ joint }) {
  const scene = state.solved.value ? state.answer.value.scene : null;
  const seat = scene?.space === "spatial" && scene.built?.seats.find((one) => one.joint === joint);
  if (!seat || seat.ends.length !== 2 || !seat.length) return null;
  const index = state.index.value;
  const most = peak(...seat.ends.flatMap(({ force }) => ["x", "y"].map((axis) => full(force[axis], scene.count))));
  const times = Number(((PLAY / seat.clearance) * (seat.length / (2 * HALF))).toPrecision(3));
  return html`<h3>Section through the pin</h3>
    ${["x", "y"].map((axis) => html`<${Section} key=${axis} seat=${seat} axis=${axis} index=${index} most=${most} />`)}
    <p class="calm">Pin of ${short(seat.links[0])} in ${short(seat.links[1])}, ${quantity(seat.length, "m")} long, play ${quantity(seat.clearance, "m")} to either side: drawn ${times} times larger across than along.
      Dashed: how far its axis may go. Arrows: load on the hole at each end, the longest ${quantity(most, "N")}.</p>`; // prettier-ignore
}

function Section({ seat, axis, index, most }) {
  const ends = seat.ends.map(({ offset, force }) => ({ off: at(offset[axis], index), load: at(force[axis], index) }));
  const [x, y] = [WIDE / 2 + 8, TALL / 2];
  const known = ends.every(({ off }) => off !== null);
  const places = ends.map(({ off }, end) => [x + (end ? HALF : -HALF), y - ((off ?? 0) / seat.clearance) * PLAY]);
  const [[ax, ay], [bx, by]] = places;
  const more = 14 * ((by - ay) / (2 * HALF)); // it stands out at both ends
  const body = (half) => `M${ax - 14},${ay - more + half}L${bx + 14},${by + more + half}`;
  const middle = known ? (ends[0].off + ends[1].off) / 2 : null;
  const tilt = known ? (ends[1].off - ends[0].off) / seat.length : null;
  const told = known ? `offset ${quantity(middle, "m", seat.clearance)}, tilt ${quantity(1e3 * tilt, "mrad", (2e3 * seat.clearance) / seat.length)}` : "no answer";
  const loads = places.map(([px, py], end) => {
    const load = ((ends[end].load ?? 0) / (most || 1)) * ARROW;
    return load ? arrow(px, py - Math.sign(load) * PIN, 0, -load) : "";
  });
  const wall = (sign) => html`<rect class="wall" x=${x - HALF} y=${y + (sign > 0 ? PIN + PLAY : -PIN - PLAY - WALL)} width=${2 * HALF} height=${WALL} />`;
  return html`<svg class="pin-section" viewBox=${`0 0 ${WIDE} ${TALL}`} role="img" aria-label=${`Section of ${seat.joint} in z and ${axis}: ${told}`}>
    ${[1, -1].map(wall)}
    ${[1, -1].map((sign) => html`<path class="reach" d=${`M${x - HALF},${y - sign * PLAY}h${2 * HALF}`} />`)}
    ${known && html`<path class="pin-body k0" d=${`${body(-PIN)}${body(PIN).replace(/M(\S+)L(\S+)/, "L$2L$1")}Z`} /><path class="axis-of-pin" d=${body(0)} />`}
    ${known && html`<path class="reaction k1" d=${loads.join("")} />`}
    <text x="2" y="13">${axis}</text><text x=${WIDE - 12} y=${TALL - 6}>z</text><text x="20" y="13">${told}</text>
  </svg>`; // prettier-ignore
}
