// An empty sheet: six examples with what each shows, and a first mechanism drawn step by step by the reader's own clicks.

import { computed, signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { place } from "../web/data.js";
import { svg } from "../web/dom.js";
import { openExample, openText, takeText } from "./actions.js";
import { Picture } from "./gallery.js";
import { dictionary, groundOf } from "./geometry.js";
import { LOOP } from "./properties.js";
import { sheet } from "./sheet.js";
import * as state from "./state.js";
import { choose } from "./tools.js";
import { Button, html } from "./ui.js";

const KEY = "trunnion studio tutorial";
const QUIET = 300; // ms until pictures are asked for: what is drawn first comes first
const [PIVOT, TIP, END] = [[-0.08, 0], [-0.08, 0.04], [0.07, 0]]; // m, of what is to be drawn

/** Examples to begin with, and what they show. */
const CARDS = [
  ["durango-fourbar", "How much torque the friction of four pins adds to a crank."],
  ["slider-crank", "Gas force, friction and bearing loads over a turn."],
  ["whitworth-quick-return", "A slotted lever that returns faster than it cuts."],
  ["toggle-press", "A small force that presses hard, and how near it is to locking."],
  ["jansen", "A leg that walks: the path of its foot, its speed and forces."],
  ["pezzuti-cardan-10mm", "In space: a Cardan joint, the friction of its bearings and their loads."],
]; // prettier-ignore

export function Welcome() {
  const { entries } = state.answer.value ?? {};
  const [quiet, setQuiet] = useState(false);
  const empty = state.answer.value && !Object.keys(entries?.links ?? {}).length && !state.text.value.trim() && state.tool.value === "select" && !guided.value;
  useEffect(() => {
    const wait = empty ? setTimeout(() => setQuiet(true), QUIET) : 0;
    return () => clearTimeout(wait);
  }, [empty]);
  if (!empty) return null;
  const about = new Map(state.about.value.examples.map((one) => [one.name, one]));
  const cards = CARDS.filter(([name]) => about.has(name));
  return html`<div class="welcome">
    <h2>An empty sheet</h2>
    <p>Draw links with two clicks each; ends that meet become joints. Pin two of them to the ground, choose the driven joint, and it moves.</p>
    <p class="row-of-buttons">
      <button type="button" class=${seen() ? "plain" : "plain strong"} onClick=${begin}>Draw a first mechanism, step by step</button>
      <button type="button" class=${seen() ? "plain strong" : "plain"} onClick=${() => choose("link")}>Draw a link</button>
      <${Button} label="Open a file …" onClick=${() => (state.dialog.value = "open")} />
      <${Button} label="A loop in space, by its table" onClick=${() => ((state.tab.value = "properties"), takeText(LOOP, "Begin a loop in space"))} />
      <${Button} label="All examples …" onClick=${() => (state.dialog.value = "examples")} />
    </p>
    <ul class="gallery">${cards.map(([name, shows]) => html`<li key=${name}><button type="button" class="card" onClick=${() => openExample(about.get(name))}>
      ${quiet ? html`<${Picture} name=${name} />` : html`<svg class="thumbnail" viewBox="0 0 168 112" aria-hidden="true"></svg>`}<span>${about.get(name).title || name}</span><span class="of">${shows}</span></button></li>`)}</ul>
  </div>`; // prettier-ignore
}

// ---- the first mechanism --------------------------------------------------------------------------------------------

/** Whether the first mechanism is being drawn. */
const guided = signal(false);
const played = signal(false);

function seen() {
  try {
    return Boolean(localStorage.getItem(KEY));
  } catch {
    return false; // storage is off
  }
}

export async function begin() {
  if (state.text.peek().trim()) await openText("", "New sheet");
  played.value = false;
  guided.value = true;
  choose("select");
  sheet.fit();
}

function leave(how) {
  guided.value = false;
  try {
    localStorage.setItem(KEY, how);
  } catch {
    // storage is off: it is offered again
  }
}

/** What is drawn by now: crank and rod with their points, joints, drivers. */
const drawn = computed(() => {
  const { entries } = state.answer.value ?? {};
  const ground = groundOf(entries);
  const [crank, rod] = Object.keys(dictionary(entries?.links)).filter((name) => name !== ground);
  const joints = Object.entries(dictionary(entries?.joints)).map(([name, one]) => ({ name, ...one }));
  const points = (link) => Object.keys(dictionary(entries?.links?.[link]?.points));
  const between = (a, b) => joints.find(({ links, type }) => links?.includes(a) && links.includes(b) && type !== "prismatic");
  const pivot = crank && between(ground, crank)?.name;
  const knee = rod && between(crank, rod)?.name;
  return {
    crank, rod, pivot, knee,
    start: crank && `${crank}.${pivot ?? points(crank)[0]}`,
    tip: crank && `${crank}.${points(crank).find((name) => name !== (pivot ?? points(crank)[0]))}`,
    end: rod && `${rod}.${points(rod).find((name) => name !== knee)}`,
    slides: joints.some(({ links, type }) => type === "prismatic" && links?.includes(ground)),
    driven: Object.keys(dictionary(entries?.drivers)).length > 0,
  };
}); // prettier-ignore

/** Steps: the tool, what to do, where, and whether it is done. */
const STEPS = [
  { tool: "link", words: "Choose Link (L). Click ring 1, then ring 2: the crank.", rings: () => [PIVOT, TIP], done: (one) => one.crank },
  { tool: "pin", words: "Choose Pin (P) and click ring 1: there the crank turns on the ground.", rings: (one) => [one.start], done: (one) => one.pivot },
  { tool: "link", words: "Choose Link (L). Click ring 1, the end of the crank, then ring 2: the rod. Ends that meet are joined.", rings: (one) => [one.tip, END], done: (one) => one.knee },
  { tool: "slide", words: "Choose Slide (G). Click ring 1, the end of the rod, then ring 2: there it slides on the ground.", rings: (one) => [one.end, [END[0] + 0.04, END[1]]], done: (one) => one.slides },
  { tool: "driver", words: "Choose Drive (D) and click ring 1, the bearing of the crank.", rings: (one) => [one.start], done: (one) => one.driven },
  { tool: null, words: "Press play under the sheet, or Space.", rings: () => [], done: () => played.value },
]; // prettier-ignore

/** How many steps are done; null where it is not being drawn. */
export const step = computed(() => {
  if (!guided.value) return null;
  if (state.solved.value && state.index.value > 0) played.value = true;
  const next = STEPS.findIndex(({ done }) => !done(drawn.value));
  return next < 0 ? STEPS.length : next;
});

/** The tool that the next step takes. */
export const nextTool = computed(() => STEPS[step.value ?? STEPS.length]?.tool ?? null);

/** Rings on the sheet where the next clicks are. */
export function rings({ frame, scene, posed }) {
  const { rings: places } = STEPS[step.value ?? STEPS.length] ?? {};
  const spots = (places?.(drawn.value) ?? []).map((one) => (typeof one === "string" ? scene && place(scene, one, posed) : one));
  return spots.flatMap((spot, order) => {
    if (!spot) return [];
    const [x, y] = frame.to(spot);
    return svg("g", { class: "ring", transform: `translate(${x.toFixed(1)},${y.toFixed(1)})` }, svg("circle", { r: 15 }), svg("text", { x: 19, y: 20 }, String(order + 1)));
  });
}

/** The card that says the next step. */
export function Guide() {
  const now = step.value ?? 0;
  const over = now === STEPS.length;
  return html`<section class="guide message-card" aria-label="First mechanism">
    <b>${over ? "It runs" : `Step ${now + 1} of ${STEPS.length}`}</b>
    <p role="status">${over ? "A slider-crank. Its torque stands under Plots; friction, loads and masses under Properties. Drag its joints to change it." : STEPS[now].words}</p>
    <${Button} label=${over ? "Close" : "Skip"} onClick=${() => leave(over ? "done" : "skipped")} /></section>`;
}
