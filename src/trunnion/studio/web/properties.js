// Values of what is chosen, as the file writes them, typed in place; the list of parts; dimensions with sliders.

import { useRef, useState } from "preact/hooks";
import { changed, edit, newest, setValue } from "./actions.js";
import { AddDimension } from "./adding.js";
import { ambiguous, bare, findingsOf, numberOf, partOfList, rowsOf, unitOf, usualUnit, written } from "./fields.js";
import { dictionary, groundOf } from "./geometry.js";
import { others, takeOther } from "./ghosts.js";
import { BarMass, Gravity, Masses } from "./masses.js";
import * as state from "./state.js";
import { LoopTable } from "./looptable.js";
import { Sections } from "./section.js";
import { removePart } from "./tools.js";
import { Button, html } from "./ui.js";

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
