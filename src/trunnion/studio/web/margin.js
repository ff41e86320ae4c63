// The locking margin, always in view: at the position that is shown, and the least of the cycle.

import * as state from "./state.js";
import { html } from "./ui.js";
import { told } from "./words.js";

const FEW = 2; // so many times the friction are near
const MEANING = "So many times the friction may grow before the position locks; at 1 and below it locks.";

export function Margin() {
  const { margin, margin_least: least, margin_why: why } = state.answer.value ?? {};
  const dragged = state.live.value; // the search for locking would take longer than a hand waits
  const words = !state.solved.value ? "—" : (why ?? (dragged ? "follows on release" : told(margin, least, state.index.value)));
  const near = !dragged && least && !least.beyond && least.value < FEW;
  return html`<span class=${near ? "margin near" : "margin"} title=${MEANING} aria-label=${`Locking margin: ${words}`} role="group">
    <b>Locking margin</b> ${words}</span>`;
}
