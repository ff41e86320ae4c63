// Curves over the drive: pointing at one moves the mechanism, and the mechanism moves their cursors.

import { effect, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { lineChart } from "../web/chart.js";
import { charts } from "../web/report.js";
import { crank } from "./motion.js";
import { kindsOf } from "./sheet.js";
import * as state from "./state.js";
import { html } from "./ui.js";

const MOST = 24; // joints whose reactions are drawn

export function Plots() {
  const holder = useRef(null);
  const shown = useRef([]);
  useEffect(() => effect(() => fill(holder.current, shown)), []);
  useEffect(() =>
    effect(() => {
      const index = state.index.value;
      shown.current.forEach((chart) => chart.show(Math.min(index, chart.last)));
    }), []); // prettier-ignore
  return html`<div class="plots">
    <div class="charts" ref=${holder}></div>
    <${Figures} />
    ${!state.solved.value && html`<p class="calm">Curves appear as soon as the mechanism has an answer.</p>`}
  </div>`;
}

function fill(holder, shown) {
  const found = state.answer.value;
  const scene = state.solved.value ? found.scene : null;
  untracked(() => {
    const list = scene ? chartsOf(scene, found.margin_least?.beyond ? null : found.margin) : [];
    const last = (scene?.count ?? 1) - 1;
    shown.current = list.map((chart) => ({ show: chart.show, last }));
    holder.replaceChildren(...list.map((chart) => chart.element));
    shown.current.forEach((chart) => chart.show(Math.min(state.index.value, last)));
  });
}

function chartsOf(scene, margin) {
  const few = { ...scene, joints: scene.joints.slice(0, MOST) };
  const list = charts(few, kindsOf(few), crank.pick);
  if (!margin) return list;
  const note = "So many times the friction may grow before it locks; at 1 it locks.";
  const series = [{ label: "margin", values: margin, kind: "k2" }];
  list.splice(1, 0, lineChart(scene, { title: "Locking margin", unit: "", series, limits: [0, 10], note, pick: crank.pick }));
  return list;
}

function Figures() {
  const { figures = [], facts = [] } = state.answer.value ?? {};
  if (!state.solved.value || !figures.length) return null;
  return html`<dl class="figures">
    ${[...figures, ...facts].map(([label, value]) => html`<div><dt>${label}</dt><dd>${value}</dd></div>`)}
  </dl>`;
}
