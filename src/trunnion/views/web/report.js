// The report page: reads the scene out of the document, builds the views, and lets the crank move them all.

import { magnifier } from "./built.js";
import { lineChart } from "./chart.js";
import { at, full, magnitude, nearest, peak, solved, state, total, usualPeak } from "./data.js";
import { html, svg } from "./dom.js";
import { fixed, quantity } from "./format.js";
import { mechanismView } from "./mechanism.js";
import { listenToKeys, player } from "./player.js";
import { polarChart } from "./polar.js";
import { seatCharts } from "./seat.js";
import { spaceView } from "./space.js";

/** Class that colours the n-th joint's curves and vectors; after six the dash changes. */
export function kindOf(order) {
  return `k${order % 6} d${Math.floor(order / 6) % 4}`;
}

/** A chart with a curve for each entry of a list, {label or name, kind}, and its values. */
function chartOf(title, unit, list, values, more = {}) {
  const series = list.map((one, order) => ({ label: one.label ?? one.name, values: values(one), kind: one.kind ?? kindOf(order) }));
  return { title, unit, series, ...more };
}

const filled = (...list) => list.filter(({ series }) => series.length);

/** What `lineChart` draws of a scene, one entry for each chart that has something to show: {title, unit, series, …}. */
export function charts(scene, kinds) {
  const { count, sums, drivers, motion } = scene;
  const joints = scene.joints.map((joint) => ({ ...joint, kind: kinds.get(joint.name) }));
  const course = (key) => (one) => full(one[key], count);
  const lost = total(joints.map((joint) => joint.friction_power), count); // prettier-ignore
  const rubbing = joints.filter(({ friction_power: power }) => peak(power) > 0);
  const losses = filled(chartOf("Friction power by joint", "W", rubbing, course("friction_power")));
  losses[0]?.series.unshift({ label: "all", values: lost, kind: "ink" });
  const slides = joints.some(({ friction }) => peak(full(friction, count)) > 0);
  const note = slides ? "Of a slide the normal force; its friction is not in it." : "";
  const forces = chartOf("Joint reactions, magnitude", "N", joints, ({ reaction }) => magnitude(reaction, count), { note });
  const turned = joints.filter(({ moment }) => scene.space === "spatial" && peak(magnitude(moment, count)) > 0);
  const about = { note: "About the middle of the bearing; without drive and friction." };
  const moments = chartOf("Reaction moments, magnitude", "N m", turned, ({ moment }) => magnitude(moment, count), about);
  const loaded = joints.filter(({ end_load: load }) => load?.length);
  const ends = filled(chartOf("Larger load on an end of bearing or guide", "N", loaded, course("end_load")));
  const reactions = [{ ...forces, series: joined(forces.series) }, ...(scene.space === "spatial" ? [moments] : []), ...ends];
  const efforts = drivers.filter(({ effort }) => !motion || peak(effort) > 0).map((driver) => effortChart(scene, driver));
  // only masses exchange theirs where no power goes through it
  const works = !motion || peak(lost, full(sums.useful_power, count), ...drivers.map(({ power }) => power)) > 0;
  const power = works ? [powerChart(scene, lost)] : [];
  const sliding = joints.filter(({ name, slide }) => slide?.length && name !== drivers[0]?.name); // that it is not over
  return [
    ...(motion ? ofMotion(motion, efforts, course) : efforts),
    ...(motion ? [] : drivers.filter(({ speed }) => speed.length)
      .map((driver) => chartOf(`Speed ${driver.name}`, driver.unit === "N" ? "m/s" : "rad/s", [{ ...driver, label: "speed" }], course("speed")))),
    ...(motion ? [...reactions, ...losses] : [...losses, ...reactions]),
    ...power,
    ...(sums.efficiency_instant ? [efficiencyChart(scene)] : []),
    ...filled(chartOf("Slide of joints", "m", sliding, course("slide"), { free: true })),
    ...errorCharts(scene, kinds),
  ]; // prettier-ignore
}

/** Speeds of the free drivers, angles and lengths apart; efforts; works and energies; forces and gaps of joints in play. */
function ofMotion({ free, energies, contacts }, efforts, course) {
  const note = "Below 0 the surfaces press each other in.";
  return filled(
    ...["rad", "m"].map((unit) => chartOf("Speed", `${unit}/s`, free.filter((one) => one.unit === unit), course("rate"))),
    ...efforts,
    chartOf("Works and energies", "J", energies, course("values")),
    chartOf("Contact forces", "N", contacts, course("force")),
    chartOf("Gaps", "m", contacts, course("gap"), { note }),
  ); // prettier-ignore
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
function errorCharts({ built, count }, kinds) {
  if (!built) return [];
  const more = { marks: built.lost, note: built.lost.length ? "Dotted: a joint loses contact." : "" };
  const course = ({ values }) => full(values, count);
  const angles = [["β", "β, between the seats of the ends"], ["ξ", "ξ, direction of the seats"]].map(([sign, title]) => {
    const rows = built.angles.filter((one) => one.sign === sign);
    const chart = chartOf(title, "°", rows, course, more);
    chart.series.forEach((one, order) => Object.assign(one, { label: rows[order].joint, kind: kinds.get(rows[order].joint), breaks: rows[order].breaks }));
    return chart;
  });
  return filled(
    chartOf("Position errors, largest", "m", built.worst, course, more),
    ...built.outputs.map((one) => chartOf(`Transmission error, ${one.label}`, one.unit, [{ ...one, label: "error" }], course, more)),
    ...angles,
  ); // prettier-ignore
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

/** Series that are the same, drawn once with the names of all: "A = B". */
function joined(series) {
  const near = 1e-6 * Math.max(0, ...series.map((one) => peak(one.values)));
  const alike = (value, other) => (Number.isFinite(value) ? Math.abs(value - other) <= near : !Number.isFinite(other));
  const list = [];
  for (const one of series) {
    const first = list.find(({ values }) => values.every((value, index) => alike(value, one.values[index])));
    if (first) first.label += ` = ${one.label}`;
    else list.push({ ...one });
  }
  return list;
}

function powerChart(scene, lost) {
  const { count } = scene;
  const drive = total(scene.drivers.map((driver) => driver.power), count); // prettier-ignore
  const useful = full(scene.sums.useful_power, count);
  const rest = drive.map((value, index) => ([value, useful[index], lost[index]].includes(null) ? null : value - useful[index] - lost[index]));
  const series = [
    { label: "drive", values: drive, kind: "k0" },
    { label: "useful", values: useful, kind: "k2" },
    { label: "friction", values: lost, kind: "k1" },
  ];
  if (peak(rest) > 1e-6 * peak(drive, useful, lost)) series.push({ label: "masses, other loads", values: rest, kind: "quiet dashed" });
  return { title: "Power", unit: "W", series };
}

/** Coordinate and speed of every free driver at the present time, as [label, index => text]. */
function stateRows({ motion }) {
  return (motion?.free ?? []).flatMap(({ name, unit, coordinate, rate }) => [
    [`${unit === "rad" ? "angle" : "slide"} ${name}`, (index) => quantity(at(coordinate, index), unit, peak(coordinate))],
    [`speed ${name}`, (index) => quantity(at(rate, index), `${unit}/s`, peak(rate))],
  ]);
}

/** The figures of the present position. */
export function readout(scene) {
  const { abscissa, drivers, joints, count } = scene;
  const lost = total(joints.map((joint) => joint.friction_power), count);
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
    mechanism.reactions(boxes.filter((box) => box.checked).map((box) => box.value), Number(size.value));
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

/** Let the times in the table of events move the motion there. */
function listenToEvents(table, scene, crank) {
  if (!scene.motion) return;
  const { values } = scene.abscissa;
  const scale = scene.motion.duration > 0 ? values[values.length - 1] / scene.motion.duration : 1;
  table?.addEventListener("click", (event) => {
    const time = event.target.dataset?.time;
    if (time !== undefined) crank.go(nearest(scene.abscissa, Number(time) * scale));
  });
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
