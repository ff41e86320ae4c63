// The report page: reads the scene out of the document, builds the views, and lets the crank move them all.

import { magnifier } from "./built.js";
import { lineChart } from "./chart.js";
import { at, full, magnitude, peak, solved, state, total, usualPeak } from "./data.js";
import { html, svg } from "./dom.js";
import { fixed, quantity } from "./format.js";
import { mechanismView } from "./mechanism.js";
import { contactCharts, energyChart, listenToEvents, speedCharts, stateRows } from "./motion.js";
import { listenToKeys, player } from "./player.js";
import { polarChart } from "./polar.js";
import { seatCharts } from "./seat.js";
import { spaceView } from "./space.js";

/** Class that colours the n-th joint's curves and vectors; after six the dash changes. */
export function kindOf(order) {
  return `k${order % 6} d${Math.floor(order / 6) % 4}`;
}

/** What `lineChart` draws of a scene, one entry for each chart that has something to show: {title, unit, series, …}. */
export function charts(scene, kinds) {
  const { count, sums, drivers, joints, motion } = scene;
  const lost = total(
    joints.map((joint) => joint.friction_power),
    count,
  );
  const driven = motion ? drivers.filter((driver) => peak(driver.effort) > 0) : drivers;
  const efforts = driven.map((driver) => effortChart(scene, driver));
  const losses = lossChart(scene, kinds, lost);
  /** @type {object[]} */
  const reactions = [reactionChart(scene, kinds)];
  if (scene.space === "spatial") reactions.push(momentChart(scene, kinds));
  reactions.push(...endChart(scene, kinds));
  const power = motion && !moved(scene, lost) ? [] : [powerChart(scene, lost)];
  const list = motion
    ? [...speedCharts(scene), ...efforts, ...energyChart(scene), ...contactCharts(scene), ...reactions, ...losses, ...power]
    : [...efforts, ...drivers.flatMap((driver) => rateChart(scene, driver)), ...losses, ...reactions, ...power];
  if (sums.efficiency_instant) list.push(efficiencyChart(scene));
  list.push(...slideChart(scene, kinds));
  return [...list, ...errorCharts(scene, kinds)];
}

/** Whether power goes through it; only masses exchange theirs where there is none. */
function moved(scene, lost) {
  return peak(lost, full(scene.sums.useful_power, scene.count), ...scene.drivers.map(({ power }) => power)) > 0;
}

function lossChart(scene, kinds, lost) {
  const losses = scene.joints
    .map((joint) => ({ label: joint.name, values: full(joint.friction_power, scene.count), kind: kinds.get(joint.name) }))
    .filter((one) => peak(one.values) > 0);
  if (!losses.length) return [];
  const series = [{ label: "all", values: lost, kind: "ink" }, ...losses];
  return [{ title: "Friction power by joint", unit: "W", series }];
}

function efficiencyChart(scene) {
  const values = full(scene.sums.efficiency_instant, scene.count).map((value) => (value === null ? null : 100 * value));
  const whole = scene.efficiency === null ? "" : `Over the whole run: ${quantity(100 * scene.efficiency, "%")}. `;
  const far = peak(values) > 100 ? "Values beyond ±100 % are not shown: the drive power is near zero there, or masses and springs give work." : "";
  return {
    title: "Efficiency at each position",
    unit: "%",
    limits: [-100, 100],
    note: whole + far,
    series: [{ label: "efficiency", values, kind: "k2" }],
  };
}

/** Errors of the worst points and of the outputs, and how the pins lie; dotted where a joint loses contact. */
function errorCharts(scene, kinds) {
  const { built, count } = scene;
  if (!built) return [];
  const marks = built.lost;
  const note = marks.length ? "Dotted: a joint loses contact." : "";
  const list = [];
  if (built.worst.length) {
    const series = built.worst.map(({ label, values }, order) => ({ label, values: full(values, count), kind: kindOf(order) }));
    list.push({ title: "Position errors, largest", unit: "m", series, marks, note });
  }
  for (const { label, unit, values } of built.outputs)
    list.push({ title: `Transmission error, ${label}`, unit, marks, note, series: [{ label: "error", values: full(values, count), kind: "k0" }] }); // prettier-ignore
  for (const [sign, title] of [["β", "β, between the seats of the ends"], ["ξ", "ξ, direction of the seats"]]) {
    const series = built.angles
      .filter((one) => one.sign === sign)
      .map(({ joint, values, breaks }) => ({ label: joint, values: full(values, count), breaks, kind: kinds.get(joint) }));
    if (series.length) list.push({ title, unit: "°", series, marks, note });
  }
  return list;
}

function effortChart(scene, driver) {
  const { count } = scene;
  const noun = driver.unit === "N" ? "force" : "torque";
  const series = [{ label: driver.ideal ? "with friction" : noun, values: full(driver.effort, count), kind: "k0" }];
  if (driver.ideal) series.push({ label: "without friction", values: full(driver.ideal, count), kind: "ink fine", quiet: true });
  const low = full(driver.effort_lower, count);
  const high = full(driver.effort_upper, count);
  const open = low.some((value, index) => value !== null && high[index] - value > 0.002 * usualPeak(scene, low, high));
  const band = open ? { low, high, kind: "k0", label: "range, friction at rest" } : null;
  return { title: `Drive ${noun} ${driver.name}`, unit: driver.unit, series, band };
}

/** The speed of a driver over the cycle, where it varies. */
function rateChart({ count }, { name, unit, speed }) {
  if (!speed.length) return [];
  const series = [{ label: "speed", values: full(speed, count), kind: "k0" }];
  return [{ title: `Speed ${name}`, unit: unit === "N" ? "m/s" : "rad/s", series }];
}

function reactionChart(scene, kinds) {
  const series = scene.joints.map((joint) => ({
    label: joint.name,
    values: magnitude(joint.reaction, scene.count),
    kind: kinds.get(joint.name),
  }));
  const slides = scene.joints.some(({ friction }) => peak(full(friction, scene.count)) > 0);
  const note = slides ? "Of a slide the normal force; its friction is not in it." : "";
  return { title: "Joint reactions, magnitude", unit: "N", series: joined(series), note };
}

/** Series that are the same, drawn once with the names of all: "A = B". */
function joined(series) {
  const near = 1e-6 * Math.max(0, ...series.map((one) => peak(one.values)));
  const same = (one, other) =>
    one.values.length === other.values.length &&
    one.values.every((value, index) => {
      const beside = other.values[index];
      return Number.isFinite(value) ? Math.abs(value - beside) <= near : !Number.isFinite(beside);
    });
  const found = [];
  for (const one of series) {
    const first = found.find((other) => same(one, other));
    if (first) first.label += ` = ${one.label}`;
    else found.push({ ...one });
  }
  return found;
}

/** How far blocks are along their guides, without a driver that the chart is over. */
function slideChart({ joints, drivers, count }, kinds) {
  const sliding = joints.filter(({ name, slide }) => slide?.length && name !== drivers[0]?.name);
  const series = sliding.map(({ name, slide }) => ({ label: name, values: full(slide, count), kind: kinds.get(name) }));
  return series.length ? [{ title: "Slide of joints", unit: "m", series, free: true }] : [];
}

function momentChart(scene, kinds) {
  const series = scene.joints
    .map(({ name, moment }) => ({ label: name, values: magnitude(moment, scene.count), kind: kinds.get(name) }))
    .filter((one) => peak(one.values) > 0);
  const note = "About the middle of the bearing; without drive and friction.";
  return { title: "Reaction moments, magnitude", unit: "N m", series, note };
}

function endChart(scene, kinds) {
  const series = scene.joints
    .filter(({ end_load }) => end_load?.length)
    .map(({ name, end_load }) => ({ label: name, values: full(end_load, scene.count), kind: kinds.get(name) }));
  return series.length ? [{ title: "Larger load on an end of bearing or guide", unit: "N", series }] : [];
}

function powerChart(scene, lost) {
  const { count } = scene;
  const drive = total(
    scene.drivers.map((driver) => driver.power),
    count,
  );
  const useful = full(scene.sums.useful_power, count);
  const rest = drive.map((value, index) =>
    value === null || useful[index] === null || lost[index] === null ? null : value - useful[index] - lost[index],
  );
  const series = [
    { label: "drive", values: drive, kind: "k0" },
    { label: "useful", values: useful, kind: "k2" },
    { label: "friction", values: lost, kind: "k1" },
  ];
  if (peak(rest) > 1e-6 * peak(drive, useful, lost))
    series.push({ label: "masses, other loads", values: rest, kind: "quiet dashed" });
  return { title: "Power", unit: "W", series };
}

/** The figures of the present position. */
export function readout(scene) {
  const { abscissa, drivers, joints, count } = scene;
  const lost = total(
    joints.map((joint) => joint.friction_power),
    count,
  );
  const gap = abscissa.unit === "°" ? "" : "\u00a0";
  const rows = [
    [abscissa.label, (index) => fixed(abscissa.values[index], peak(abscissa.values)) + gap + abscissa.unit],
    ...(abscissa.label === "time" ? [] : [["time", (index) => quantity(at(scene.time, index), "s", peak(scene.time))]]),
    ...stateRows(scene),
    ...drivers.map(({ name, unit, effort }) => [
      `${unit === "N" ? "force" : "torque"} ${name}`,
      (index) => quantity(at(effort, index), unit, usualPeak(scene, effort), scene.units),
    ]),
    ["friction power", (index) => quantity(lost[index], "W", usualPeak(scene, lost), scene.units)],
    ["status", (index) => state(scene, index)],
  ];
  const cells = rows.map(() => html("dd", {}, "—"));
  const element = html(
    "dl",
    { class: "readout" },
    ...rows.map(([label], order) =>
      html("div", { class: label === "status" ? label : null }, html("dt", {}, label), cells[order]),
    ),
  );
  const show = (index) => {
    rows.forEach(([, text], order) => (cells[order].textContent = text(index)));
    element.classList.toggle("unsolved", !solved(scene, index));
  };
  return { element, show, words: (index) => `${scene.abscissa.label} ${rows[0][1](index)}, ${state(scene, index)}` };
}

/** Which reaction vectors are drawn, and how long. */
function vectorControls(scene, kinds, mechanism) {
  const boxes = scene.joints.map((joint) => html("input", { type: "checkbox", checked: true, value: joint.name }));
  const size = html(
    "select",
    { "aria-label": "Length of the vectors" },
    ...[0.25, 0.5, 1, 2, 4, 10].map((factor) =>
      html("option", { value: factor, selected: factor === 1 }, `× ${factor}`),
    ),
  );
  const all = html("button", { type: "button", class: "plain" }, "none");
  const apply = () => {
    mechanism.reactions(
      boxes.filter((box) => box.checked).map((box) => box.value),
      Number(size.value),
    );
    all.textContent = boxes.some((box) => box.checked) ? "none" : "all";
  };
  all.addEventListener("click", () => {
    const wanted = all.textContent === "all";
    boxes.forEach((box) => (box.checked = wanted));
    apply();
  });
  [...boxes, size].forEach((control) => control.addEventListener("change", apply));
  const labels = scene.joints.map((joint, order) =>
    html(
      "label",
      { class: `chip ${kinds.get(joint.name)}` },
      boxes[order],
      html("span", { class: "swatch bar" }),
      joint.name,
    ),
  );
  return html("fieldset", { class: "vectors" }, html("legend", {}, "Reactions"), ...labels, all, size);
}

/** The polar diagrams; in space of the plane that is chosen. */
function polarPanel(scene, kinds, pick, place) {
  const panel = {
    charts: [],
    index: 0,
    show(index) {
      panel.index = index;
      panel.charts.forEach((chart) => chart.show(index));
    },
  };
  const fill = (plane) => {
    panel.charts.forEach((chart) => chart.element.remove());
    panel.charts = scene.joints.map((joint) => polarChart(scene, joint, kinds.get(joint.name), pick, plane));
    place.append(...panel.charts.map((chart) => chart.element));
    panel.show(panel.index);
  };
  if (scene.space === "spatial") {
    const planes = html("select", {}, ...["x–y", "x–z", "y–z"].map((name) => html("option", {}, name)));
    planes.addEventListener("change", () => fill(planes.value.split("–")));
    place.append(html("label", { class: "plane" }, "Plane ", planes));
  }
  fill(["x", "y"]);
  return panel;
}

/** Build the page into its places; of these only the stage must be there. */
export function start(scene, places) {
  const kinds = new Map(scene.joints.map((joint, order) => [joint.name, kindOf(order)]));
  const spatial = scene.space === "spatial";
  const mechanism = spatial ? spaceView(scene, kinds) : mechanismView(scene, kinds);
  const figures = readout(scene);
  /** @type {{ show(index: number): void }[]} */
  const views = [mechanism, figures];
  const crank = player(scene.count, figures.words, (index) => views.forEach((view) => view.show(index)), {
    svg,
    duration: scene.motion?.duration ?? null,
  });
  const pick = (index, firm) => {
    if (firm) crank.go(index);
    else if (!crank.playing()) crank.go(index);
  };
  const curves = places.charts ? charts(scene, kinds).map((one) => lineChart(scene, { ...one, pick })) : [];
  const seats = places.seats ? seatCharts(scene, kinds) : [];
  places.seats?.append(...seats.map((chart) => chart.element));
  views.push(...curves, ...seats);
  if (places.polars) views.push(polarPanel(scene, kinds, pick, places.polars));
  const hint = html(
    "p",
    { class: "hint" },
    "Space plays, ← and → step (Shift: ten), Home and End jump; point at a curve " +
      (scene.motion ? "to go to that time." : "to move the mechanism.") +
      (spatial ? " Drag turns the mechanism, with Shift or the right button it shifts, the wheel zooms; so do the keys ← → ↑ ↓ + − 0 once it has the focus." : "") +
      (scene.apart ? " Joints on one spot are drawn apart along their axes; between them the scale does not hold." : ""),
  );
  const vectors = vectorControls(scene, kinds, mechanism);
  const errors = scene.built ? magnifier(scene.built, html, (factor) => mechanism.magnify(factor)) : null;
  places.stage.append(
    ...[mechanism.element, crank.element, errors, figures.element, vectors, mechanism.controls, hint].filter(Boolean),
  );
  places.charts?.append(...curves.map((chart) => chart.element));
  listenToEvents(places.events, scene, crank);
  listenToKeys(document, crank);
  crank.go(0);
  if (places.stage.dataset?.plays && !globalThis.matchMedia?.("(prefers-reduced-motion: reduce)").matches) crank.toggle();
  return crank;
}

if (globalThis.document) {
  const find = (id) => document.getElementById(id);
  const data = find("scene");
  if (data)
    start(JSON.parse(data.textContent), { stage: find("stage"), charts: find("charts"), polars: find("polars"), seats: find("seats"), events: find("happened") });
}
