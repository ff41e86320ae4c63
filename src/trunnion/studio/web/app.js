// The page: bars, sheet or space, player, and the panel at the right.

import { computed, effect } from "@preact/signals";
import { discard, save, takeWaiting } from "./actions.js";
import { BottomBar, Hint, ToolBar, TopBar, ZoomBar } from "./bars.js";
import { Blocks, Formula } from "./blocks.js";
import { Bounded, Failures } from "./boundary.js";
import { Dialogs } from "./dialogs.js";
import { Findings, jump, Text } from "./findings.js";
import { GroupBar } from "./group.js";
import { ContextMenu } from "./menu.js";
import { Motion } from "./motion.js";
import { Plots } from "./plots.js";
import { Properties } from "./properties.js";
import { Errors } from "./errors.js";
import { sheet } from "./sheet.js";
import { Space } from "./space.js";
import { Stage } from "./stage.js";
import { Guide, Welcome, step as taught } from "./start.js";
import * as state from "./state.js";
import { pointer } from "./tools.js";
import { Button, focusOn, html } from "./ui.js";

const TOP = 140; // px, where messages stand
const TABS = { properties: ["Properties", Properties], plots: ["Plots", Plots], blocks: ["Blocks", Blocks], text: ["Text", Text], findings: ["Findings", Findings] };

export function App() {
  const bounded = (...parts) => parts.map((Part) => html`<${Bounded} key=${Part.name}><${Part} /><//>`);
  return html`${bounded(TopBar)}
    <main class="studio">
      ${bounded(ToolBar)}
      <div class="middle-part">
        <div class="window">
          ${state.spatial.value ? bounded(Space) : bounded(Stage, ZoomBar, Welcome)}
          ${bounded(Errors, Formula)}
          ${bounded(Messages)}
          ${bounded(ContextMenu)}
        </div>
        ${bounded(Motion)}
      </div>
      ${bounded(Divider, Panel)}
    </main>
    ${bounded(BottomBar, Dialogs)}`;
}

/** Figures of before are grey while new ones are awaited. */
export const keepAwaited = () => effect(() => void document.body.classList.toggle("awaited", state.awaited.value));

const LEAST = 300; // px of the panel, and of the sheet beside it
const STEP = 24; // px that an arrow key moves the divider

/** Between sheet and panel: dragged, or moved by arrow keys. */
function Divider() {
  const set = (width) => {
    const most = Math.max(window.innerWidth - LEAST, LEAST);
    document.documentElement.style.setProperty("--panel-width", `${Math.round(Math.min(Math.max(width, LEAST), most))}px`);
  };
  const drag = (event) => event.buttons && set(window.innerWidth - event.clientX);
  const key = (event) => {
    const by = { ArrowLeft: STEP, ArrowRight: -STEP }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    set(document.querySelector(".panel").getBoundingClientRect().width + by);
  };
  return html`<div class="divider" role="separator" tabindex="0" aria-orientation="vertical" aria-label="Width of the panel" title="Drag, or use the arrow keys"
    onPointerDown=${(event) => event.currentTarget.setPointerCapture(event.pointerId)} onPointerMove=${drag} onKeyDown=${key}></div>`; // prettier-ignore
}

function Panel() {
  const open = state.tab.value;
  const count = state.findings.value.filter(({ severity }) => severity !== "note").length;
  const step = (event) => {
    const names = Object.keys(TABS);
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    state.tab.value = names[(names.indexOf(open) + by + names.length) % names.length];
    requestAnimationFrame(() => focusOn("[role=tab][aria-selected=true]"));
  };
  const [title, Body] = TABS[open];
  return html`<aside class="panel">
    <div class="tabs" role="tablist" aria-label="Panel" onKeyDown=${step}>
      ${Object.entries(TABS).map(([name, [label]]) => html`<button type="button" role="tab" class="tab" aria-selected=${name === open} tabindex=${name === open ? 0 : -1}
        onClick=${() => (state.tab.value = name)}>${label}${name === "findings" && count > 0 ? html` <span class="count">${count}</span>` : ""}</button>`)}
    </div>
    <div class="body" role="tabpanel" aria-label=${title}><${Body} /></div>
  </aside>`; // prettier-ignore
}

/** Whether the hand is where messages stand: then they make room for it. */
const low = computed(() => {
  const at = state.live.value?.to ?? (state.tool.value === "select" ? null : pointer.value?.spot.at);
  return Boolean(at && sheet.view && sheet.view.frame.to(at)[1] < TOP);
});

/** Recovered work, and in a sentence why it does not move. */
function Messages() {
  const time = state.recovered.value;
  const wrong = state.findings.value.filter(({ severity }) => severity === "error");
  const lacks = state.tool.value === "select" ? state.missing.value : [];
  const clock = (one) => new Date(one).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", hour12: false });
  const waiting = state.waiting.value;
  const lesson = taught.value !== null; // its rings are above the middle
  return html`<div class=${low.value || lesson ? "messages below" : "messages"}>
    ${lesson ? html`<${Guide} />` : html`<${Hint} />`}
    <${GroupBar} />
    <${Failures} />
    ${state.stopped.value && html`<div class="message-card bad" role="alert">${state.stopped.value}</div>`}
    ${state.unkept.value && state.unsaved.value && html`<div class="message-card bad" role="alert">The browser has no room for this work: it is lost when the page closes. <${Button} label="Save it" onClick=${() => save()} /></div>`}
    ${time && html`<div class="message-card">Unsaved work of ${clock(time)} recovered.${state.basis.value === state.savedText.value ? "" : ` ${state.fileName.value} was changed elsewhere since.`}
      <${Button} label="Discard it" onClick=${discard} /> <${Button} label="Keep it" onClick=${() => (state.recovered.value = null)} /></div>`}
    ${waiting && html`<div class="message-card">${waiting.name ? `Unsaved work on ${waiting.name}` : "A sheet that was not saved"} is left from ${clock(waiting.time)}.
      <${Button} label="Open it" onClick=${() => takeWaiting(true)} /> <${Button} label="Throw it away" onClick=${() => takeWaiting(false)} /></div>`}
    ${lacks.length > 0 && html`<div class="message-card">${lacks.join(" ")}</div>`}
    ${wrong.length > 0 && html`<button type="button" class="message-card bad" title="Point at it for the whole; click it to see where, and what to do" onClick=${() => (jump(wrong[0]), (state.tab.value = "findings"))}>
      <b>${wrong[0].place}</b> ${wrong[0].what}${wrong[0].remedy ? ` — ${wrong[0].remedy}` : ""}${wrong.length > 1 ? ` (and ${wrong.length - 1} more)` : ""}${state.answer.value?.bare ? "; until then it is shown without friction" : ""}</button>`}
  </div>`; // prettier-ignore
}
