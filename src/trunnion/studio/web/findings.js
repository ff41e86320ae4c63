// What the checks found, each with its place, its line and a remedy.

import { partOf } from "./fields.js";
import * as state from "./state.js";
import { html } from "./ui.js";

const MOST = 200;

export function Findings() {
  const found = state.findings.value;
  const lacks = state.missing.value;
  if (!found.length) return html`<p class="calm">${lacks.join(" ") || "No errors or warnings."}</p>`;
  return html`<div>
    ${lacks.length > 0 && html`<p class="calm">${lacks.join(" ")}</p>`}
    ${found.slice(0, MOST).map((one) => html`<${Finding} one=${one} />`)}
    ${found.length > MOST && html`<p class="calm">and ${found.length - MOST} more.</p>`}
  </div>`;
}

export function Finding({ one, onLine = null }) {
  const { severity, what, where, place, remedy, line } = one;
  const part = partOf(one, state.answer.value?.entries);
  const show = () => {
    state.selection.value = part;
    state.tab.value = "properties";
  };
  return html`<div class=${`finding ${severity}`}>
    <p>
      <span class="severity">${severity[0].toUpperCase() + severity.slice(1)}</span>
      ${where && (part ? html`<button type="button" class="where link" title=${where} onClick=${show}>${place}</button> ` : html`<span class="where" title=${where}>${place}</span> `)}
      ${what} ${remedy && html`<span class="remedy">— ${remedy}</span>`}
      ${line && (onLine ? html` <button type="button" class="link" onClick=${() => onLine(line)}>line ${line}</button>` : html` <span class="remedy">(line ${line})</span>`)}
    </p>
  </div>`; // prettier-ignore
}
