// Values of what is chosen, as the file writes them, typed in place; the list of parts; dimensions with sliders.

import { useRef, useState } from "preact/hooks";
import { edit, setValue } from "./actions.js";
import { findingsOf, numberOf, rowsOf, unitOf, written } from "./fields.js";
import { dictionary } from "./geometry.js";
import { others, takeOther } from "./ghosts.js";
import * as state from "./state.js";
import { removePart } from "./tools.js";
import { Button, html } from "./ui.js";

const NOUNS = { links: "Link", joints: "Joint", points: "Point", drivers: "Driver", loads: "Load", springs: "Spring" };
const SECTIONS = ["links", "joints", "drivers", "loads", "springs"];
const MOST = 300; // parts in a list

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
        ${kind === "links" || kind === "joints" ? html`<${Name} kind=${kind} name=${name} />` : html` <span>${name}</span>`}
      </h2>
      <${Rows} rows=${rows} findings=${findings} />
      ${driver && html`<h3>Driver</h3><${Rows} rows=${rowsOf(entries, "drivers", name)} findings=${findings} />`}
      <p class="row-of-buttons">
        ${kind === "joints" && !driver && html`<${Button} label="Drive this joint" onClick=${() => edit([{ do: "driver", joint: name }])} />`}
        ${kind === "points" && html`<${Button} label="Pin to the ground" onClick=${() => edit([{ do: "pin", point: name }])} />`}
        <${Button} label=${`Delete ${NOUNS[kind].toLowerCase()}`} onClick=${() => removePart({ kind, name })} />
        <${Button} label="All parts" onClick=${() => (state.selection.value = null)} />
      </p>
    </section>`; // prettier-ignore
}

function Name({ kind, name }) {
  const take = (event) => {
    const to = event.target.value.trim();
    if (to === name || !to) return (event.target.value = name);
    const { target } = event;
    edit([{ do: "rename", what: [kind, name], to }]).then(() => {
      const there = dictionary(state.answer.value?.entries?.[kind]);
      if (there[name] !== undefined) target.value = name; // it was refused
      else if (there[to] !== undefined) state.selection.value = { kind, name: to };
    });
  };
  return html`<input class="name-of-part" aria-label="Name" value=${name} onChange=${take} />`;
}

function Rows({ rows, findings }) {
  return html`<div class="rows">${rows.map((row) => html`<${Row} key=${row.path.join(".")} row=${row} findings=${findings} />`)}</div>`;
}

/** A value, or the parts of a list, with what is wrong about it. */
function Row({ row, findings }) {
  const { path, label, value, example, fixed } = row;
  const wrong = findingsOf(findings, path).filter(({ severity }) => severity !== "note");
  const id = `value-${path.join("-")}`;
  const list = Array.isArray(value ?? example);
  if (fixed) return html`<div class="row"><span class="label">${label}</span><span class="fixed">${list ? value.join(", ") : value}</span></div>`;
  const parts = list ? (value ?? example.map(() => "")) : [value ?? ""];
  const sound = { ...row, value: wrong.length ? null : value }; // a unit that is refused goes with its number
  const put = (order) => (event) => take(sound, parts, list, order, event.target.value);
  return html`<div class="row">
    <label class="label" for=${`${id}-0`}>${label}</label>
    <span class="values">
      ${parts.map((one, order) => html`<input key=${order} id=${`${id}-${order}`} value=${one} placeholder=${example && `e.g. ${list ? example[order] : example}`}
        aria-label=${list ? `${label}, part ${order + 1}` : label} aria-invalid=${wrong.length > 0}
        aria-describedby=${wrong.length ? `${id}-wrong` : null} onChange=${put(order)} spellcheck=${false} />`)}
    </span>
    ${wrong.length > 0 && html`<p class="wrong" id=${`${id}-wrong`}>${wrong.map(({ what, remedy }) => `${what}${remedy ? ` — ${remedy}` : ""}`).join("; ")}</p>`}
  </div>`; // prettier-ignore
}

function take(row, parts, list, order, typed) {
  const { path, example } = row;
  const own = written(typed, unitOf(row, order));
  if (!list) return setValue(path, own);
  const next = parts.map((one, place) => (place === order ? own : written(one)));
  if (next.every((one) => one === null)) return setValue(path, null);
  return setValue(path, next.map((one, place) => one ?? written(String(example?.[place] ?? "0"))));
}

/** What belongs to no part, the dimensions, and a list of all parts. */
function Model() {
  const { entries, findings } = state.answer.value ?? {};
  const dimensions = Object.entries(dictionary(entries?.dimensions));
  return html`<section><h2>Model</h2><${Rows} rows=${rowsOf(entries, "model")} findings=${findings} /></section>
    ${dimensions.length > 0 && html`<section><h2>Dimensions</h2><div class="rows">
      ${dimensions.map(([name, value]) => html`<${Dimension} key=${name} name=${name} value=${value} findings=${findings} />`)}
    </div></section>`}
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

/** A dimension with a slider from none to twice of it; all that one pull of the slider changes is one step. */
function Dimension({ name, value, findings }) {
  const path = ["dimensions", name];
  const number = numberOf(value);
  const [pulled, setPulled] = useState(null);
  const sending = useRef({ busy: false, wanted: null });
  const start = pulled?.from ?? number;
  const pull = async (event) => {
    const next = `${Number(Number(event.target.value).toPrecision(4))} ${start.rest}`.trim();
    setPulled({ from: start, text: next });
    sending.current.wanted = next;
    if (sending.current.busy) return;
    sending.current.busy = true;
    while (sending.current.wanted) {
      const text = sending.current.wanted;
      sending.current.wanted = null;
      await setValue(path, written(text), `slider ${name}`);
    }
    sending.current.busy = false;
    setPulled(null);
  };
  const slides = start && start.value !== 0;
  return html`<div class="dimension">
    <${Row} row=${{ path, label: name, value: pulled?.text ?? String(value), example: null }} findings=${findings} />
    ${slides && html`<input type="range" aria-label=${`${name}, slider`} min=${Math.min(0, 2 * start.value)} max=${Math.max(0, 2 * start.value)}
      step=${Math.abs(start.value) / 200} value=${numberOf(pulled?.text ?? value)?.value} onInput=${pull} />`}
  </div>`; // prettier-ignore
}
