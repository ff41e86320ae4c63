// What the tolerances of the model do to its largest effort and strokes, under the plots.

import { effect, signal, untracked } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { askOf } from "./actions.js";
import * as state from "./state.js";
import { openStudy } from "./studies.js";
import { html } from "./ui.js";

/** {scene, rows, why} of the latest answer, or null. */
const told = signal(null);

export function Tolerances() {
  useEffect(() =>
    effect(() => {
      if (ready()) untracked(ask);
      else told.value = null;
    }), []); // prettier-ignore
  const found = told.value;
  if (!found?.rows.length || found.scene !== state.answer.value?.scene) return null;
  return html`<section class="changes tolerances" aria-label="Tolerances"><h3>What the tolerances do (first order)</h3>
    <table><thead><tr><th scope="col"><span class="unseen">Figure</span></th>${["nominal", "worst case", "σ"].map((head) => html`<th scope="col" class="figure">${head}</th>`)}</tr></thead>
    <tbody>${found.rows.map(({ label, texts }) => html`<tr><th scope="row">${label}</th>${texts.map((text) => html`<td class="figure">${text}</td>`)}</tr>`)}</tbody></table>
    <p class="calm">${found.why.map((one) => `${one}. `)}<button type="button" class="link" onClick=${() => openStudy("tolerance")}>Samples, yield and shares …</button></p></section>`; // prettier-ignore
}

function ready() {
  return state.solved.value && state.answer.value.ready.some(({ what, ok }) => what === "tolerance" && ok);
}

async function ask() {
  const found = await askOf("tolerances", {});
  told.value = found && { ...found, scene: state.answer.value.scene };
}
