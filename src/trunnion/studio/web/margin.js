// The locking margin, always in view: at the position that is shown, and the least of the cycle.

import * as state from "./state.js";
import { html } from "./ui.js";
import { at, told } from "./words.js";

const FEW = 2; // so many times the friction are near
const MEANING = "So many times the friction may grow before the position locks; at 1 and below it locks.";

export function Margin() {
  const { margin, margin_least: least, margin_why: why } = state.answer.value ?? {};
  const live = state.live.value?.margin; // while the mechanism is being changed
  const words = !state.solved.value ? "—" : (why ?? (live ? at(live) : told(margin, least, state.index.value)));
  const low = why ? null : (live ?? least);
  const near = low && low.value !== null && !low.beyond && low.value < FEW;
  return html`<span class=${near ? "margin near" : "margin"} title=${MEANING} aria-label=${`Locking margin: ${words}`} role="group">
    <b>Locking margin</b> ${words}</span>`;
}
