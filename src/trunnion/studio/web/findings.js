// What the checks found, each with its place, its line and a remedy; a remedy in numbers can be tried.

import { batch, effect, signal, untracked } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { edit, typed, undo } from "./actions.js";
import { least, partOf } from "./fields.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

const MOST = 200;

/** The remedy that was tried last: {label, before, after, text}, the margins before and after it; or null. */
const tried = signal(null);

export function Findings() {
  const found = state.findings.value;
  const lacks = state.missing.value;
  return html`<div>
    <${Tried} />
    ${!found.length && html`<p class="calm">${lacks.join(" ") || "No errors or warnings."}</p>`}
    ${found.length > 0 && lacks.length > 0 && html`<p class="calm">${lacks.join(" ")}</p>`}
    ${found.slice(0, MOST).map((one) => html`<${Finding} one=${one} />`)}
    ${found.length > MOST && html`<p class="calm">and ${found.length - MOST} more.</p>`}
  </div>`;
}

/** Show where a finding holds: its position, and the part that it is about. */
export function jump(one) {
  batch(() => {
    if (Number.isInteger(one.index)) state.index.value = one.index;
    state.selection.value = partOf(one, state.answer.value?.entries) ?? state.selection.value;
  });
}

/** Write a remedy into the model, as a step to undo, and tell the least margin before and after it. */
async function attempt({ label, gestures }) {
  const before = state.answer.value.margin_least;
  if (!(await edit(gestures))) return;
  const { margin_least: after, text } = state.answer.value;
  tried.value = { label, before, after, text };
  state.say(outcome(tried.value));
}

const outcome = ({ label, before, after }) => `${label}: least locking margin ${least(before)}, now ${least(after)}.`;

function Tried() {
  if (!tried.value || tried.value.text !== state.text.value) return null;
  return html`<p class="tried" role="status">Tried: ${outcome(tried.value)} <${Button} label="Take it back" onClick=${undo} /></p>`;
}

export function Finding({ one }) {
  const { severity, what, where, place, remedy, line, index, cures = [] } = one;
  const part = partOf(one, state.answer.value?.entries);
  const show = () => {
    jump(one);
    if (part) state.tab.value = "properties";
  };
  const goTo = () => ([state.tab.value, state.line.value] = ["text", line]);
  return html`<div class=${`finding ${severity}`}>
    <p>
      <span class="severity">${severity[0].toUpperCase() + severity.slice(1)}</span>
      ${where && (part || Number.isInteger(index) ? html`<button type="button" class="where link" title=${`Show ${part ? part.name : "the position"}`} onClick=${show}>${place}</button> ` : html`<span class="where" title=${where}>${place}</span> `)}
      ${what} ${remedy && html`<span class="remedy">— ${remedy}</span>`}
      ${line && html` <button type="button" class="link" onClick=${goTo}>line ${line}</button>`}
    </p>
    ${cures.length > 0 && html`<p class="row-of-buttons">${cures.map((cure) => html`<${Button} label=${`Try ${cure.label}`} title="Write it into the model; undo takes it back" onClick=${() => attempt(cure)} />`)}</p>`}
  </div>`; // prettier-ignore
}

// ---- the text of the model -----------------------------------------------------------------------------------------

export function Text() {
  const area = useRef(null);
  const gutter = useRef(null);
  useLayoutEffect(() =>
    effect(() => {
      const content = state.text.value;
      if (area.current.value !== content) area.current.value = content;
      const lines = Math.min(content.split("\n").length, 20000);
      gutter.current.textContent = Array.from({ length: lines }, (_, order) => order + 1).join("\n");
    }), []); // prettier-ignore
  useLayoutEffect(() => effect(() => state.line.value && untracked(() => goTo(state.line.value))), []);
  const goTo = (line) => {
    state.line.value = null;
    const before = state.text.value.split("\n").slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
    const end = state.text.value.indexOf("\n", before);
    area.current.focus();
    area.current.setSelectionRange(before, end < 0 ? state.text.value.length : end);
    area.current.scrollTop = Math.max((line - 6) * 19, 0);
  }; // prettier-ignore
  const wrong = state.findings.value.filter(({ severity }) => severity !== "note");
  return html`<div class="text-of-model">
    <div class="editor">
      <pre class="gutter" ref=${gutter} aria-hidden="true"></pre>
      <textarea ref=${area} aria-label="Model file" spellcheck=${false} wrap="off" autocomplete="off"
        onInput=${(event) => typed(event.target.value)}
        onScroll=${(event) => (gutter.current.scrollTop = event.target.scrollTop)}></textarea>
    </div>
    ${wrong.length > 0 && html`<div class="findings-of-text">${wrong.slice(0, 50).map((one) => html`<${Finding} one=${one} />`)}</div>`}
  </div>`; // prettier-ignore
}
