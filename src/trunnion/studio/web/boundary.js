// What goes wrong in the page itself: it is told, and the rest of the page goes on.

import { useEffect, useErrorBoundary } from "preact/hooks";
import { undo } from "./actions.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

/** A part of the page that cannot be drawn says so in its place, and is drawn again with the next answer. */
export function Bounded({ children }) {
  const [problem, again] = useErrorBoundary();
  const answer = state.answer.value;
  useEffect(() => problem && again(), [answer]);
  return problem ? html`<${Failure} problem=${problem} onContinue=${again} />` : children;
}

/** What failed outside of drawing: in taking an answer, following a signal, doing what was clicked. */
export function Failures() {
  const problem = state.failure.value;
  return problem && html`<${Failure} problem=${problem} onContinue=${() => (state.failure.value = null)} />`;
}

function Failure({ problem, onContinue }) {
  const back = () => {
    onContinue();
    undo();
  };
  return html`<div class="message-card bad" role="alert">The page made a mistake here: ${String(problem.message ?? problem)}. Your work is as it was.
    <${Button} label="Continue" onClick=${onContinue} /> <${Button} label="Undo the last step" disabled=${!state.past.value.length} onClick=${back} /></div>`; // prettier-ignore
}

export function listenToFailures() {
  addEventListener("error", ({ error }) => error && (state.failure.value = error)); // without one it is a remark of the browser
  addEventListener("unhandledrejection", ({ reason }) => (state.failure.value = reason));
}
