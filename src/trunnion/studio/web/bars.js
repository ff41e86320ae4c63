// The bars around the sheet: file, undo, friction and export above; tools at the left; readiness and margin below.

import { exported, openText, redo, save, undo } from "./actions.js";
import { at, told } from "./fields.js";
import { LAYERS } from "./layers.js";
import { sheet } from "./sheet.js";
import { begin, nextTool } from "./start.js";
import * as state from "./state.js";
import { openStudy, STUDY_OF } from "./studies.js";
import { nextTheme, theme } from "./theme.js";
import { choose, hint, TOOLS } from "./tools.js";
import { Button, html, Icon, Menu } from "./ui.js";

const EXPORTS = [["csv", "Table (CSV)"], ["png", "Picture (PNG)"], ["svg", "Picture (SVG)"], ["report", "Report (HTML)"]]; // prettier-ignore

export function TopBar() {
  const { past, future, fileName, unsaved, dialog } = state;
  const [before, after] = [past, future].map(({ value }) => value[value.length - 1]?.name);
  return html`<header class="bar top">
    <b class="brand">Trunnion</b>
    <${Menu} label="File">
      <${Button} label="New sheet" onClick=${() => openText("", "New sheet")} />
      <${Button} label="Open …" title="Open (Ctrl+O)" onClick=${() => (dialog.value = "open")} />
      <${Button} label="Examples …" onClick=${() => (dialog.value = "examples")} />
      <${Button} label="Save" title="Save (Ctrl+S)" onClick=${() => save()} />
      <${Button} label="Save as …" onClick=${() => (dialog.value = "save")} />
      <${Button} label="First mechanism …" title="Draw a slider-crank step by step" onClick=${begin} />
      <${Button} label="Keys …" title="What the keys do (?)" onClick=${() => (dialog.value = "keys")} />
    <//>
    <span class="file" title=${state.folder.value.folder}>${fileName.value ?? "Not saved yet"}<span class=${unsaved.value ? "changed" : "changed none"} aria-hidden=${!unsaved.value} title="There are changes that are not saved"> · changed</span></span>
    <${Button} kind="icon" label=${before ? `Undo: ${before}` : "Undo"} title=${before ? `Undo: ${before} (Ctrl+Z)` : "Nothing to undo"} disabled=${!before} onClick=${undo}><${Icon} name="undo" /><//>
    <${Button} kind="icon" label=${after ? `Redo: ${after}` : "Redo"} title=${after ? `Redo: ${after} (Ctrl+Shift+Z)` : "Nothing to redo"} disabled=${!after} onClick=${redo}><${Icon} name="redo" /><//>
    <span class="step-name">${before ? `after “${before}”` : ""}</span>
    <span class="room"></span>
    <label class="choice">Friction
      <select value=${state.friction.value} onChange=${(event) => (state.friction.value = event.target.value)}>
        <option value="stated">as stated</option><option value="compare">with and without</option><option value="off">none</option>
      </select>
    </label>
    ${!state.spatial.value && html`<${Menu} label="Show">
      ${LAYERS.map(([name, label]) => html`<label class="tick"><input type="checkbox" checked=${state.layers.value[name]}
        onChange=${(event) => (state.layers.value = { ...state.layers.value, [name]: event.target.checked })} /> ${label}</label>`)}
      <label class="tick"><input type="checkbox" checked=${state.snapping.value} onChange=${(event) => (state.snapping.value = event.target.checked)} /> Snap to the grid</label>
    <//>`}
    <${Button} label="Studies …" title="Locking, design, play, tolerance, allocation, motion in time, sweep, measured data" disabled=${!state.solved.value} onClick=${() => openStudy()} />
    <${Menu} label="Export" disabled=${!state.solved.value}>${EXPORTS.map(([what, label]) => html`<${Button} label=${label} onClick=${() => exported(what)} />`)}<//>
    <${Button} kind="icon" label=${`Colours: ${theme.value}`} title=${`Colours: ${theme.value}; click for the next`} onClick=${nextTheme}><${Icon} name=${theme.value} /><//>
  </header>`; // prettier-ignore
}

export function ToolBar() {
  if (state.spatial.value) return null;
  const take = (id) => ({ detail }) => {
    choose(id);
    if (detail) sheet.view?.root.focus(); // of a mouse: the next key is for the sheet, not for the button
  };
  return html`<nav class="tools" aria-label="Tools">
    ${TOOLS.map(
      ({ id, label, key, hint: words }) => html`<button type="button" class=${nextTool.value === id && state.tool.value !== id ? "tool hinted" : "tool"} aria-pressed=${state.tool.value === id}
        title=${`${label} (${key}): ${words[0]}`} onClick=${take(id)}><${Icon} name=${id} /><span>${label}</span></button>`,
    )}
  </nav>`; // prettier-ignore
}

/** What to do next with the tool, over the sheet. */
export function Hint() {
  const dragged = state.live.value?.to; // what it changes stands where the hand looks
  const words = state.tool.value !== "select" ? hint() : dragged ? state.notice.value.words : "";
  return words ? html`<p class="next-step">${words}</p>` : null;
}

export function ZoomBar() {
  return html`<div class="zoom">
    <${Button} kind="icon" label="Zoom in" title="Zoom in (+)" onClick=${() => sheet.zoom(1.25)}>+<//>
    <${Button} kind="icon" label="Zoom out" title="Zoom out (−)" onClick=${() => sheet.zoom(0.8)}>−<//>
    <${Button} kind="icon" label="Show all" title="Show all (0)" onClick=${() => sheet.fit()}><${Icon} name="fit" /><//>
  </div>`;
}

/** Readiness, locking margin, what to do next. */
export function BottomBar() {
  const { ready = [] } = state.answer.value ?? {};
  const { words, bad } = state.notice.value;
  return html`<footer class="bar bottom">
    <ul class="ready" aria-label="What the model is ready for">
      ${ready.map(({ what, ok, why }) => html`<li><button type="button" class=${ok ? "chip ok" : "chip"} title=${why} aria-label=${`${what}: ${ok ? "ready" : "not yet"}. ${why}`}
        onClick=${() => (ok && STUDY_OF[what] ? openStudy(STUDY_OF[what]) : state.say(`${what[0].toUpperCase()}${what.slice(1)}: ${why}`))}><span aria-hidden="true">${ok ? "✓" : "–"}</span> ${what}</button></li>`)}
    </ul>
    <${Margin} />
    <span class=${bad ? "notice bad" : "notice"} title=${words}>${words || hint()}</span>
    <span class="work">${state.connected.value ? (state.busy.value ? "Working …" : "") : "Connection lost; trying again …"}</span>
    <span class="unseen" role="status" aria-live="polite">${words}</span>
  </footer>`; // prettier-ignore
}

// ---- the locking margin, always in view ----------------------------------------------------------------------------

const FEW = 2; // so many times the friction are near
const MEANING = "So many times the friction may grow before the position locks; at 1 and below it locks.";

function Margin() {
  const { margin, margin_least: least, margin_why: why } = state.answer.value ?? {};
  const live = state.live.value?.margin; // while the mechanism is being changed
  const words = !state.solved.value ? "—" : (why ?? (live ? at(live) : told(margin, least, state.index.value)));
  const low = why ? null : (live ?? least);
  const near = low && low.value !== null && !low.beyond && low.value < FEW;
  return html`<span class=${near ? "margin near" : "margin"} title=${MEANING} aria-label=${`Locking margin: ${words}`} role="group">
    <b>Locking margin</b> ${words}</span>`;
}
