// Curves over the drive: pointing at one moves the mechanism, and the mechanism moves their cursors. Variants are laid over.

import { effect, signal, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { lineChart } from "../web/chart.js";
import { full, magnitude, say as position } from "../web/data.js";
import { quantity } from "../web/format.js";
import { polarChart } from "../web/polar.js";
import { charts } from "../web/report.js";
import { seatCharts } from "../web/seat.js";
import { askOf } from "./actions.js";
import { framed, laid } from "./layers.js";
import { crank } from "./motion.js";
import { kindsOf } from "./sheet.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";
import { compared, Variants } from "./variants.js";

const MOST = 24; // joints that are all drawn; of more the most loaded
const LOADED = 12;
const FEW = 2; // curves of a variant that are named one by one
const DASHES = ["variant", "variant second"];
const BEYOND = 10; // a margin that is larger is drawn there
const MEANING = "So many times the friction may grow before it locks; at 1 it locks. More than 10 is drawn at 10.";

/** Whether the polar diagrams are open, and in space the plane they are seen in. */
const polars = signal(false);
const seats = signal(false);
const plane = signal("x–y");

export function Plots() {
  return html`<div class="plots">
    <${Variants} />
    ${state.solved.value && state.answer.value.scene.joints.length > MOST && html`<p class="calm">Of ${state.answer.value.scene.joints.length} joints the ${LOADED} most loaded are shown; others are among the curves of your choice.</p>`}
    <${Curves} class="charts" listOf=${curves} />
    <${Chosen} />
    <${Polars} />
    <${Seats} />
    <${Joints} />
    <${Figures} />
    ${!state.solved.value && html`<p class="calm">Curves appear as soon as the mechanism is solved.</p>`}
  </div>`;
}

/** Charts of the present scene, [{element, show}] of `listOf(found, others)`, that follow the position. */
function Curves({ class: kind, listOf }) {
  const holder = useRef(null);
  useEffect(() => {
    let [list, last] = [[], 0];
    const box = holder.current; // an answer may come as the panel goes
    const follow = (index) => list.forEach((chart) => chart.show(Math.min(index, last)));
    const stop = [
      effect(() => {
        const found = state.solved.value ? state.answer.value : null;
        const others = compared.value.filter((one) => one.scene && one.scene.count === found?.scene.count);
        list = found ? listOf(found, others) : [];
        last = (found?.scene.count ?? 1) - 1;
        list.forEach(({ element }) => Object.assign(element, { tabIndex: 0, ariaLabel: `${element.querySelector(".title").textContent}, curves over the drive: the arrow keys move the position` }));
        const focused = box.contains(document.activeElement) ? document.activeElement.ariaLabel : null;
        box.replaceChildren(...list.map((chart) => chart.element));
        list.find(({ element }) => element.ariaLabel === focused)?.element.focus({ preventScroll: true }); // keys go on where they were
        untracked(() => follow(state.index.value));
      }),
      effect(() => follow(state.index.value)),
    ];
    return () => stop.forEach((end) => end());
  }, []);
  return html`<div class=${kind} ref=${holder} onKeyDown=${stepOn} onPointerLeave=${({ pointerType }) => pointerType === "mouse" && crank.leave()}></div>`;
}

/** Arrows on a chart in focus move the mechanism, with Shift by ten, and its values are said. */
function stepOn(event) {
  const chart = event.target.closest(".chart");
  const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!by || !chart) return;
  event.preventDefault();
  event.stopPropagation();
  crank.go(state.index.peek() + by * (event.shiftKey ? 10 : 1));
  const values = [...chart.querySelectorAll(".legend li")].map(({ children }) => [...children].map((one) => one.textContent).join(" ").trim());
  state.say(`${position(state.answer.value.scene, state.index.peek())}: ${values.join(", ")} ${chart.querySelector(".unit").textContent}`);
}

/** Charts of the answer with those of the variants laid over, and of the chosen point. */
function curves(found, others) {
  const { scene } = found;
  const list = listed(found);
  const point = laid.value?.scene === scene ? laid.value.point : null;
  if (point) list.splice(1, 0, ...ofPoint(point));
  others.forEach((other, order) => {
    const moving = point && other.point?.key === point.key ? ofPoint(other.point) : [];
    for (const one of [...listed(other), ...moving]) lay(list.find(({ title }) => title === one.title), one, other.name, DASHES[order]);
  });
  return list
    .filter((one) => !one.only || one.series.length > 1)
    .map((one) => lineChart(framed(scene), { ...one, pick: crank.pick }));
}

function listed({ scene, margin, margin_least: least }) {
  const few = { ...scene, joints: drawnJoints(scene) };
  const list = charts(few, kindsOf(few));
  const series = margin ? [{ label: "margin", values: margin, kind: "k2", most: BEYOND }] : [];
  // one that is beyond 10 everywhere is shown only beside another
  list.splice(1, 0, { title: "Locking margin", unit: "", series, limits: [0, BEYOND], note: MEANING, only: !margin || least?.beyond });
  return list;
}

/** The joints that are drawn: of many those with the largest reactions. */
function drawnJoints(scene) {
  const { joints, count } = scene;
  if (joints.length <= MOST) return joints;
  scene.loaded ??= joints.map((joint) => ({ joint, most: Math.max(...magnitude(joint.reaction, count).map((size) => size ?? 0)) }))
    .sort((one, other) => other.most - one.most).slice(0, LOADED).map(({ joint }) => joint); // prettier-ignore
  return scene.loaded;
}

/** Lay the series of a variant's chart over the one of the same title. */
function lay(chart, { series }, name, dash) {
  if (!chart) return;
  const unlisted = series.length > FEW;
  if (unlisted) chart.note = `${chart.note ?? ""} ${dash === DASHES[0] ? "Dashed" : "Dotted"}: ${name}.`.trim();
  chart.series.push(...series.map((one) => ({ ...one, label: `${one.label}, ${name}`, kind: `${one.kind} ${dash}`, quiet: true, unlisted })));
}

/** Velocity and acceleration of a point. */
function ofPoint({ key, velocity, acceleration }) {
  return [["Velocity", velocity, "m/s"], ["Acceleration", acceleration, "m/s²"]].map(([word, parts, unit]) => {
    const count = Math.max(...Object.values(parts).map((one) => one.length));
    const axes = Object.entries(parts).map(([axis, values], order) => ({ label: axis, values: full(values, count), kind: `k${order} d${order + 1}` }));
    return { title: `${word} of ${key}`, unit, series: [{ label: "magnitude", values: magnitude(parts, count), kind: "ink" }, ...axes] };
  }); // prettier-ignore
}

/** Curves that the reader has chosen from the table of the cycle. */
function Chosen() {
  return state.solved.value && html`<section class="own-curves" aria-label="Curves of your choice"><h2>Curves of your choice</h2><${Choice} /><${Curves} class="charts" listOf=${chosenCharts} /></section>`;
}

/** The largest reaction and friction power of each joint, and where. */
function Joints() {
  const { scene, figures = [], coming } = state.answer.value ?? {};
  if (!state.solved.value) return null;
  const ofCycle = (name) => !coming && figures.find(([label]) => label.startsWith(`reaction of ${name}, maximum`)); // between positions too
  const largest = (values) => values.reduce((best, value, index) => ((value ?? -1) > (values[best] ?? -1) ? index : best), 0);
  const rows = drawnJoints(scene).map(({ name, reaction, friction_power: power }) => {
    const cell = (values, unit) => {
      const index = largest(values);
      return values[index] ? [quantity(values[index], unit, undefined, scene.units), position(scene, index)] : ["0", ""];
    };
    const friction = full(power, scene.count).map((value) => (value === null ? null : Math.abs(value)));
    const [label, value] = ofCycle(name) || [];
    return [name, ...(label ? [value, label.split(", at ")[1] ?? ""] : cell(magnitude(reaction, scene.count), "N")), ...cell(friction, "W")];
  });
  const head = ["joint", "largest reaction", "at", "largest friction power", "at"];
  const copy = () => navigator.clipboard?.writeText([head, ...rows].map((row) => row.join("\t")).join("\n")).then(() => state.say("The table is on the clipboard."));
  return html`<details class="of-joints"><summary>Largest loads of the joints</summary>
    <table><thead><tr>${head.map((word) => html`<th>${word}</th>`)}</tr></thead><tbody>${rows.map((row) => html`<tr>${row.map((cell) => html`<td>${cell}</td>`)}</tr>`)}</tbody></table>
    <${Button} label="Copy the table" onClick=${copy} /></details>`; // prettier-ignore
}

/** Polar diagrams of the reactions: the force vector of each joint as a closed curve. */
function Polars() {
  if (!state.solved.value) return null;
  const spatial = state.spatial.value;
  return html`<details class="polars" open=${polars.value} onToggle=${(event) => (polars.value = event.currentTarget.open)}>
    <summary>Reactions as vectors (polar diagrams)</summary>
    ${spatial && html`<label class="plane">Plane <select value=${plane.value} onChange=${(event) => (plane.value = event.target.value)}>
      ${["x–y", "x–z", "y–z"].map((one) => html`<option>${one}</option>`)}</select></label>`}
    ${polars.value && html`<p class="calm">The tip of each force over the cycle, on the second link of the joint.</p><${Curves} class="charts polar-charts" listOf=${loops} />`}
  </details>`; // prettier-ignore
}

/** Each end of a pin in its hole: the path of its middle, where it touches, and its load. */
function Seats() {
  const { scene } = state.answer.value ?? {};
  if (!state.solved.value || !scene.built?.seats.length) return null;
  const diagrams = (found) => seatCharts(found.scene, kindsOf(found.scene)).slice(0, MOST);
  return html`<details class="polars" open=${seats.value} onToggle=${(event) => (seats.value = event.currentTarget.open)}>
    <summary>Pins in their holes</summary>${seats.value && html`<${Curves} class="charts polar-charts" listOf=${diagrams} />`}</details>`; // prettier-ignore
}

function loops({ scene }, others) {
  const kinds = kindsOf(scene);
  const axes = plane.value.split("–");
  const seen = scene.space === "spatial" ? axes : ["x", "y"];
  const [other] = others;
  return drawnJoints(scene).map((joint) => {
    const ideal = other?.scene.joints.find(({ name }) => name === joint.name)?.reaction ?? null;
    const chart = polarChart(framed(scene), { ...joint, ideal }, kinds.get(joint.name), crank.pick, seen);
    if (ideal) chart.element.append(Object.assign(document.createElement("p"), { className: "remark", textContent: `Dashed: ${other.name}` }));
    return chart;
  });
}

function Figures() {
  const { figures = [], facts = [], coming } = state.answer.value ?? {};
  if (!state.solved.value || (!figures.length && !coming)) return null;
  return html`<dl class="figures" aria-busy=${Boolean(coming)}>
    ${coming && !figures.length && html`<div><dt>figures of the cycle</dt><dd>being calculated …</dd></div>`}
    ${[...figures, ...facts].map(([label, value]) => html`<div><dt>${label}</dt><dd>${value}</dd></div>`)}
  </dl>`;
}

// ---- curves of the reader's choice ---------------------------------------------------------------------------------

const TYPED = /^(insertText|delete|insertComposition)/; // letters, which may be the beginning of a longer name

/** Names of the chosen columns, and what they are drawn over: "" for the drive, else a column. */
const chosen = signal([]);
const over = signal("");
/** Answer to the latest question: {names, columns, scene}; or null. */
const told = signal(null);

/** Ask for the columns whenever others are chosen or there is a new answer. */
export function keepCurves() {
  effect(() => {
    const scene = state.solved.value ? state.answer.value.scene : null;
    const names = [...chosen.value, over.value].filter(Boolean);
    const wanted = state.tab.value === "plots";
    untracked(() => {
      if (told.value && told.value.scene !== scene) told.value = null;
      if (scene && wanted) askOf("curves", { names }).then((found) => found && (told.value = { ...found, scene }));
    });
  });
}

/** A chart for each unit of the chosen columns. */
function chosenCharts({ scene }) {
  const found = told.value;
  if (!found || found.scene !== scene) return [];
  const columns = chosen.value.filter((name) => found.columns[name]).map((name) => ({ name, unit: found.columns[name].unit, values: full(found.columns[name].values, scene.count) }));
  const units = [...new Set(columns.map(({ unit }) => unit))];
  const across = over.value ? found.columns[over.value] : null;
  const along = across && full(across.values, scene.count);
  const angle = across?.unit === "rad" ? 180 / Math.PI : 1;
  const abscissa = across
    ? { label: over.value, unit: across.unit === "rad" ? "°" : across.unit === "1" ? "" : across.unit, closed: false, values: along.map((value) => (value === null ? null : value * angle)) }
    : scene.abscissa;
  return units.map((unit) => {
    const series = columns.filter((one) => one.unit === unit).map(({ name, values }, order) => ({
      label: name, kind: `k${order % 8}`, values: across ? values.map((value, index) => (along[index] === null ? null : value)) : values,
    })); // prettier-ignore
    const title = series.length === 1 ? series[0].label : `${series.length} curves`;
    return lineChart(across ? { ...framed(scene), abscissa, status: scene.status.map(() => 0), motion: null } : framed(scene), { title, unit, series, pick: crank.pick });
  });
}

/** What is drawn, and over what. */
function Choice() {
  const names = told.value?.names ?? [];
  const known = (name) => names.some(([one]) => one === name);
  const unknown = (name) => state.say(`The table has no column ${name}.`, true);
  const add = (event) => {
    const name = event.target.value.trim();
    if (!name) return;
    if (!known(name)) return unknown(name);
    if (!chosen.value.includes(name)) chosen.value = [...chosen.value, name];
    event.target.value = "";
  };
  const picked = (event) => !TYPED.test(event.inputType ?? "") && known(event.target.value) && add(event); // from the list
  const across = (event) => {
    const name = event.target.value.trim();
    if (name && !known(name)) return unknown(name);
    over.value = name;
  };
  return html`<div class="choice-of-curves">
    <datalist id="columns">${names.map(([name, unit]) => html`<option value=${name}>${unit}</option>`)}</datalist>
    <label class="choice">Curve <input list="columns" aria-label="Curve to add" placeholder="coupler.angle_velocity, A.effort …" onChange=${add} onInput=${picked} /></label>
    <label class="choice">over <input list="columns" aria-label="Over" placeholder="the drive" value=${over.value} onChange=${across} /></label>
    <p class="row-of-buttons">${chosen.value.map((name) => html`<button type="button" class="plain" title="Take this curve away" onClick=${() => (chosen.value = chosen.value.filter((one) => one !== name))}>${name} ×</button>`)}</p>
  </div>`; // prettier-ignore
}
