// Curves of the reader's choice: any column of the table of the cycle, over the drive, the time or another column.

import { effect, signal, untracked } from "@preact/signals";
import { lineChart } from "../web/chart.js";
import { full } from "../web/data.js";
import { framed } from "./layers.js";
import { askOf } from "./actions.js";
import { crank } from "./motion.js";
import * as state from "./state.js";
import { html } from "./ui.js";

const TYPED = /^(insertText|delete|insertComposition)/; // letters, which may be the beginning of a longer name

/** Names of the chosen columns, and what they are drawn over: "" for the drive, else a column. */
const chosen = signal([]);
const over = signal("");
/** Answer to the latest question: {names, columns, scene}; or null. */
const told = signal(null);

/** Ask for the columns whenever others are chosen or there is a new answer. */
export function keepCurves() {
  effect(() => {
    const scene = state.solved.value ? state.answer.value.scene : null;
    const names = [...chosen.value, over.value].filter(Boolean);
    const wanted = state.tab.value === "plots";
    untracked(() => {
      if (told.value && told.value.scene !== scene) told.value = null;
      if (scene && wanted) askOf("curves", { names }).then((found) => found && (told.value = { ...found, scene }));
    });
  });
}

/** A chart for each unit of the chosen columns. */
export function chosenCharts({ scene }) {
  const found = told.value;
  if (!found || found.scene !== scene) return [];
  const columns = chosen.value.filter((name) => found.columns[name]).map((name) => ({ name, unit: found.columns[name].unit, values: full(found.columns[name].values, scene.count) }));
  const units = [...new Set(columns.map(({ unit }) => unit))];
  const across = over.value ? found.columns[over.value] : null;
  const along = across && full(across.values, scene.count);
  const angle = across?.unit === "rad" ? 180 / Math.PI : 1;
  const abscissa = across
    ? { label: over.value, unit: across.unit === "rad" ? "°" : across.unit === "1" ? "" : across.unit, closed: false, values: along.map((value) => (value === null ? null : value * angle)) }
    : scene.abscissa;
  return units.map((unit) => {
    const series = columns.filter((one) => one.unit === unit).map(({ name, values }, order) => ({
      label: name, kind: `k${order % 8}`, values: across ? values.map((value, index) => (along[index] === null ? null : value)) : values,
    })); // prettier-ignore
    const title = series.length === 1 ? series[0].label : `${series.length} curves`;
    return lineChart(across ? { ...framed(scene), abscissa, status: scene.status.map(() => 0), motion: null } : framed(scene), { title, unit, series, pick: crank.pick });
  });
}

/** What is drawn, and over what. */
export function Choice() {
  const names = told.value?.names ?? [];
  const known = (name) => names.some(([one]) => one === name);
  const unknown = (name) => state.say(`The table has no column ${name}.`, true);
  const add = (event) => {
    const name = event.target.value.trim();
    if (!name) return;
    if (!known(name)) return unknown(name);
    if (!chosen.value.includes(name)) chosen.value = [...chosen.value, name];
    event.target.value = "";
  };
  const picked = (event) => !TYPED.test(event.inputType ?? "") && known(event.target.value) && add(event); // from the list
  const across = (event) => {
    const name = event.target.value.trim();
    if (name && !known(name)) return unknown(name);
    over.value = name;
  };
  return html`<div class="choice-of-curves">
    <datalist id="columns">${names.map(([name, unit]) => html`<option value=${name}>${unit}</option>`)}</datalist>
    <label class="choice">Curve <input list="columns" aria-label="Curve to add" placeholder="coupler.angle_velocity, A.effort …" onChange=${add} onInput=${picked} /></label>
    <label class="choice">over <input list="columns" aria-label="Over" placeholder="the drive" value=${over.value} onChange=${across} /></label>
    <p class="row-of-buttons">${chosen.value.map((name) => html`<button type="button" class="plain" title="Take this curve away" onClick=${() => (chosen.value = chosen.value.filter((one) => one !== name))}>${name} ×</button>`)}</p>
  </div>`; // prettier-ignore
}
