// How large errors and play are drawn, and the worst corner of a measure: over the sheet and the view in space.

import { told } from "../web/built.js";
import { askOf, setValue } from "./actions.js";
import { crank } from "./motion.js";
import { cornered } from "./sheet.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

const LONGEST = 3; // powers of ten that the slider spans
const SIDES = ["least", "largest"];

/** Draw the errors so many times as large, to two digits. */
const magnify = (factor) => (state.factor.value = Number(factor.toPrecision(2)));

/** Look at the worst corner of a measure, the worse one if no side is named; of "" at the mechanism as it is. */
async function look(measure, side = null) {
  if (!measure) return void (state.corner.value = null);
  const { scene } = state.answer.value;
  const found = await askOf("corner", { measure, side });
  if (!found) return;
  state.corner.value = { ...found, measure, of: scene };
  if (state.factor.value === 1) magnify(found.scene.built.preset);
  if (found.index !== null) crank.go(found.index);
}

export function Errors() {
  const { scene, worst = [], unseated = [] } = state.answer.value ?? {};
  const corner = cornered.value;
  const built = corner?.scene.built ?? scene?.built;
  if (!state.solved.value || state.live.value || (!built && !worst.length)) return null;
  const factor = state.spatial.value || state.tool.value === "select" ? state.factor.value : 1; // what is drawn is drawn as it is
  return html`<section class="errors-drawn" aria-label="Errors and play as they are drawn">
    ${built && html`<label class="choice">Errors <input type="range" class="magnification" min="0" max=${LONGEST} step="0.01" value=${Math.log10(factor)}
        aria-label="Magnification of the errors, logarithmic" aria-valuetext=${`errors ${told(factor)} times as large`} onInput=${(event) => magnify(10 ** Number(event.target.value))} /></label>
      <output class="factor">× ${told(factor)}</output>
      ${!corner && [...new Set([1, built.preset])].map((one) => html`<${Button} label=${`× ${told(one)}`} title=${`Draw errors ${told(one)} times as large`} pressed=${factor === one} onClick=${() => magnify(one)} />`)}`}
    ${!corner && !built?.seats.length && unseated.length > 0 && html`<${Button} label="Press the pins by their loads" title=${`The pins of ${unseated.join(", ")} run in the middle of their holes: let them lie where they are pressed (seat: loaded)`}
      onClick=${() => setValue(["joint_defaults", "seat"], "loaded")} />`}
    ${worst.length > 0 && html`<label class="choice">Worst case of <select title=${corner?.measure ?? ""} value=${corner?.measure ?? ""} onChange=${(event) => look(event.target.value)}>
      <option value="">– as it is –</option>${worst.map((name) => html`<option>${name}</option>`)}</select></label>`}
    ${corner && html`<${Corner} ...${corner} />`}
  </section>`; // prettier-ignore
}

/** Both ends of the measure, the one that is shown pressed, and the numbers there. */
function Corner({ measure, texts, side, at, rows }) {
  const end = (order) => html`<${Button} label=${`${texts[order]}${order === side && at ? ` at ${at}` : ""}`} title=${`The ${SIDES[order]} that ${measure} becomes`}
    pressed=${order === side} onClick=${() => look(measure, SIDES[order])} />`; // prettier-ignore
  return html`<span class="row-of-buttons" role="group" aria-label=${`Ends of ${measure}`}>${end(0)}${end(1)}</span>
    ${rows.length > 0 && html`<details class="of-corner"><summary>numbers</summary><div><table>
      <thead><tr><th scope="col">number</th><th scope="col" class="figure">nominal</th><th scope="col" class="figure">change</th></tr></thead>
      <tbody>${rows.map(([name, nominal, change]) => html`<tr><th scope="row">${name.replace("dimensions.", "")}</th><td class="figure">${nominal}</td><td class="figure">${change}</td></tr>`)}</tbody></table></div></details>`}`; // prettier-ignore
}
