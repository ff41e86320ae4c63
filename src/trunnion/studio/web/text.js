// The model file as text: what is typed is solved, and what is drawn stands in it at once.

import { effect, untracked } from "@preact/signals";
import { useLayoutEffect, useRef } from "preact/hooks";
import { typed } from "./actions.js";
import { Finding } from "./findings.js";
import * as state from "./state.js";
import { html } from "./ui.js";

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
