// Variant A: the state that was kept, beside the present one in plots, sheet and a table; and the same without friction.

import { effect, signal, untracked } from "@preact/signals";
import { askOf, takeText } from "./actions.js";
import { columnsOf, laid, motionOf } from "./layers.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

/** Variants beside the present scene: [{name, ghost, heads, scene, margin, why, rows}]. */
export const compared = signal([]);

/** Ask for the variants whenever one is wanted and there is a new answer. */
export function keepCompared() {
  effect(() => {
    const found = state.solved.value ? state.answer.value : null;
    const point = laid.value?.point?.key;
    const wanted = found ? variants(state.variant.value, found, state.friction.value === "compare") : [];
    untracked(() => {
      if (!wanted.length) compared.value = [];
      else
        askOf("compare", { names: columnsOf(point), others: wanted.map(({ text, friction }) => ({ text, friction })) }).then((told) => {
          if (told) compared.value = told.others.map((one, order) => ({ ...wanted[order], ...laidOver(one, found.scene), point: point && one.scene ? motionOf(one.columns, point) : null, rows: rowsOf(told.figures, one.figures), of: found.text }));
        });
    });
  });
}

/** The variants of an answer: A where it is another than that, and the same without friction. */
export function variants(own, { text, friction }, free) {
  const list = [];
  if (own && (own.text !== text || own.friction !== friction))
    list.push({ name: "variant A", ghost: own.text !== text, heads: ["variant A", "now"], ...own });
  if (free) list.push({ name: "without friction", ghost: false, heads: ["without", "with"], text, friction: "off" });
  return list;
}

/** A variant without its scene where it runs over other positions of the drive. */
function laidOver(one, { abscissa }) {
  const own = one.scene?.abscissa;
  const near = 1e-5 * (Math.max(...abscissa.values.map(Math.abs)) || 1);
  const same = own && own.label === abscissa.label && own.unit === abscissa.unit && own.values.length === abscissa.values.length && own.values.every((value, index) => Math.abs(value - abscissa.values[index]) <= near);
  return same || !own ? one : { ...one, scene: null, why: "runs over other positions of the drive than the present one: its curves cannot be laid over" };
}

/** Rows of the table, [{label, texts}]: the figures of a variant beside the present ones, and their change. */
function rowsOf(now, before) {
  return now.map(({ name, title, text, value }) => {
    const other = before.find((one) => one.name === name);
    const change = other?.value && value !== null ? Math.round((1000 * (value - other.value)) / Math.abs(other.value)) / 10 : null;
    const sign = change ? (change < 0 ? "−" : "+") : ""; // none of what is rounding
    return { label: title, texts: [other?.text ?? "—", text, change === null ? "—" : `${sign}${Math.abs(change).toFixed(1)} %`] };
  });
}

function keep() {
  const { text, friction } = state.answer.value;
  state.variant.value = { text, friction, time: new Date().toISOString() };
  state.say("Kept as variant A: change the mechanism, and both are shown.");
}

/** The buttons that keep a variant, and the tables of what it changes. */
export function Variants() {
  const own = state.variant.value;
  const clock = own && new Date(own.time).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", hour12: false });
  const same = own && state.answer.value?.text === own.text && state.answer.value.friction === own.friction;
  return html`<section class="variants" aria-label="Variants">
    <p class="row-of-buttons">
      <${Button} label=${own ? "Keep this instead" : "Keep as variant A"} title="Keep the present state as variant A, to compare with what follows" disabled=${!state.solved.value || same || state.answer.value.bare} onClick=${keep} />
      ${own && html`<${Button} label="Go back to A" disabled=${state.text.value === own.text} onClick=${() => takeText(own.text, "Go back to variant A")} />
        <${Button} label="Drop A" onClick=${() => (state.variant.value = null)} />
        <span class="calm">${same ? `Variant A, kept ${clock}, is what is shown.` : `A kept ${clock}.`}</span>`}
    </p>
    ${compared.value.map((one) => html`<${Changes} one=${one} />`)}
  </section>`; // prettier-ignore
}

function Changes({ one: { name, heads, rows, why, of } }) {
  const title = `${name[0].toUpperCase()}${name.slice(1)}`;
  return html`<div class=${of === state.text.value ? "changes" : "changes stale"}>
    ${why && html`<p class="calm">${title} ${why}.</p>`}
    ${rows.length > 0 && html`<table>
      <caption class="unseen">${title} and the present state</caption>
      <thead><tr><th scope="col"><span class="unseen">Figure</span></th>${[...heads, "change"].map((head) => html`<th scope="col" class="figure">${head}</th>`)}</tr></thead>
      <tbody>${rows.map(({ label, texts }) => html`<tr><th scope="row">${label}</th>${texts.map((text) => html`<td class="figure">${text}</td>`)}</tr>`)}</tbody>
    </table>`}
  </div>`; // prettier-ignore
}
