// Polar reaction diagram of one joint: the tip of the force vector over the run, in the global frame.

import { grid } from "./chart.js";
import { at, extent, magnitude, outside, peak, usualPeak } from "./data.js";
import { clipped, figure, html, onWidth, set, svg } from "./dom.js";
import { fixed, prefixed, quantity, ticks } from "./format.js";

const MARGIN = { top: 10, right: 14, bottom: 42, left: 60 };
const NEAR = 18; // px: a pointer without a button as near to the curve points at it

/**
 * The diagram of a joint {name, reaction, ideal}, seen in the plane of two axes; `kind` colours it, `pick(index, firm)` is
 * called when the reader points at the curve.
 */
export function polarChart(scene, { name, reaction, ideal }, kind, pick, /** @type {string[]} */ [across, up] = ["x", "y"]) {
  const flat = (vector) => vector && { x: vector[across], y: vector[up] };
  const joint = { name, reaction: flat(reaction), ideal: flat(ideal) };
  const sizes = magnitude(joint.reaction, scene.count);
  const free = joint.ideal ? magnitude(joint.ideal, scene.count) : [];
  const most = usualPeak(scene, sizes, free);
  const highest = peak(sizes, free);
  const cut = most < highest ? most : null; // then the window shows what is usual, around the origin
  const scale = prefixed(most, "N", scene.units);
  const plot = html("div", { class: "plot" });
  const value = html("span", { class: "value" }, "—");
  const remark = `The peak of ${quantity(highest, "N", undefined, scene.units)} ${outside(scene)}`;
  const notes = cut === null ? null : html("p", { class: "remark" }, remark);
  const element = figure("chart polar", joint.name, scale.unit, value, plot, notes);
  const chart = { scene, joint, kind, scale, cut, plot, axes: [across, up], frame: null, index: 0 };
  onWidth(plot, (width) => draw(chart, width), 220);
  const point = (event, firm) => {
    const found = chart.frame && closest(chart, event, firm ? Infinity : NEAR);
    if (found !== null) pick(found, firm);
  };
  plot.addEventListener("pointerdown", (event) => point(event, true));
  plot.addEventListener("pointermove", (event) => point(event, event.buttons > 0));
  return {
    element,
    show(index) {
      chart.index = index;
      value.textContent =
        sizes[index] === null ? "—" : `${fixed(sizes[index] * scale.factor, most * scale.factor)} ${scale.unit}`;
      moveVector(chart);
    },
  };
}

function draw(chart, width) {
  const { joint, kind } = chart;
  const side = width - MARGIN.left - MARGIN.right;
  const height = side + MARGIN.top + MARGIN.bottom;
  const { middle, half } = around(chart);
  const frame = {
    width,
    side,
    left: MARGIN.left,
    right: MARGIN.left + side,
    top: MARGIN.top,
    bottom: MARGIN.top + side,
    x: (value) => MARGIN.left + ((value - middle[0]) / half + 1) * (side / 2),
    y: (value) => MARGIN.top + (1 - (value - middle[1]) / half) * (side / 2),
  };
  chart.frame = frame;
  chart.vector = svg("line", { class: `vector ${kind}` });
  chart.tip = svg("circle", { class: `dot ${kind}`, r: 4 });
  const across = ticks(middle[0] - half, middle[0] + half, 4);
  const up = ticks(middle[1] - half, middle[1] + half, 4);
  chart.plot.replaceChildren(
    svg(
      "svg",
      {
        viewBox: `0 0 ${width} ${height}`,
        role: "img",
        "aria-label": `Polar diagram of the reaction in joint ${joint.name}`,
      },
      ...grid(frame, across, up, true),
      svg("text", { class: "axis middle", x: MARGIN.left + side / 2, y: height - 5 }, `F${chart.axes[0]}`),
      svg("text", { class: "axis", x: 0, y: MARGIN.top + side / 2, dy: "0.32em" }, `F${chart.axes[1]}`),
      clipped(
        { x: MARGIN.left, y: MARGIN.top, width: side, height: side },
        joint.ideal ? svg("path", { class: "curve free", d: loop(chart, joint.ideal) }) : null,
        svg("path", { class: `curve ${kind}`, d: loop(chart, joint.reaction) }),
        chart.vector,
      ),
      ...marks(chart, side),
      chart.tip,
      ...captions(chart, side),
    ),
  );
  moveVector(chart);
}

/** A square window around the curves and the origin. */
function around({ joint, cut, scale: { factor } }) {
  if (cut !== null) return { middle: [0, 0], half: 1.07 * cut * factor };
  const both = [joint.reaction, ...(joint.ideal ? [joint.ideal] : [])];
  const [x0, x1] = extent([[0], ...both.map((one) => one.x)]);
  const [y0, y1] = extent([[0], ...both.map((one) => one.y)]);
  const half = (Math.max(x1 - x0, y1 - y0) / 2) * factor * 1.14 || 1;
  return { middle: [((x0 + x1) / 2) * factor, ((y0 + y1) / 2) * factor], half };
}

function spot({ frame, scale }, vector, index) {
  const x = at(vector.x, index);
  const y = at(vector.y, index);
  return x === null || y === null ? null : [frame.x(x * scale.factor), frame.y(y * scale.factor)];
}

function loop(chart, vector) {
  const { scene } = chart;
  let path = "";
  let pen = "M";
  for (let index = 0; index < scene.count + (scene.abscissa.closed ? 1 : 0); index += 1) {
    const place = spot(chart, vector, index % scene.count);
    if (place) path += `${pen}${place[0].toFixed(1)},${place[1].toFixed(1)}${pen === "M" ? "h0" : ""}`;
    pen = place ? "L" : "M";
  }
  return path;
}

/** The places of every twelfth of a closed turn that lie in the window, [{index, place, quarter}]. */
function twelfths(chart, side) {
  const { scene, joint } = chart;
  if (!scene.abscissa.closed || scene.count < 12) return [];
  return Array.from({ length: 12 }, (_, order) => Math.round((order * scene.count) / 12))
    .map((index, order) => ({ index, place: spot(chart, joint.reaction, index), quarter: order % 3 === 0 }))
    .filter(({ place }) => place && within(place, side));
}

function marks(chart, side) {
  return twelfths(chart, side).map(({ place: [cx, cy] }) =>
    svg("circle", { class: `milestone ${chart.kind}`, cx, cy, r: 2.2 }),
  );
}

/** The angle at every quarter of a turn, unless it would lie on another. */
function captions(chart, side) {
  const dots = twelfths(chart, side);
  const middle = [0, 1].map((axis) => dots.reduce((sum, { place }) => sum + place[axis], 0) / dots.length);
  const labelled = [];
  for (const dot of dots) {
    const crowded = labelled.some(({ place: [x, y] }) => Math.hypot(dot.place[0] - x, dot.place[1] - y) < 26);
    if (dot.quarter && !crowded) labelled.push(dot);
  }
  return labelled.map((dot) => caption(chart, dot, middle, side));
}

function within(/** @type {number[]} */ [x, y], side) {
  return x >= MARGIN.left && x <= MARGIN.left + side && y >= MARGIN.top && y <= MARGIN.top + side;
}

/** The angle beside its dot: across the curve, away from its middle, inside the frame. */
function caption(chart, /** @type {{ index: number, place: number[] }} */ { index, place: [x, y] }, middle, side) {
  const { scene, joint } = chart;
  const text = `${Math.round(scene.abscissa.values[index])}°`;
  const half = 3.2 * text.length;
  const before = spot(chart, joint.reaction, (index + scene.count - 1) % scene.count) ?? [x, y];
  const after = spot(chart, joint.reaction, (index + 1) % scene.count) ?? [x, y];
  const [ax, ay] = [after[1] - before[1], before[0] - after[0]];
  const size = (Math.hypot(ax, ay) || 1) * (ax * (x - middle[0]) + ay * (y - middle[1]) < 0 ? -1 : 1);
  const inside = (value, low, room, space) => Math.min(Math.max(value, low + space), low + room - space);
  return svg(
    "text",
    {
      class: "mark middle",
      x: inside(x + (ax / size) * (half + 8), MARGIN.left, side + 10, half),
      y: inside(y + (ay / size) * 13, MARGIN.top, side, 7),
      dy: "0.34em",
    },
    text,
  );
}

function moveVector(chart) {
  if (!chart.frame) return;
  const tip = spot(chart, chart.joint.reaction, chart.index);
  const hidden = tip ? null : "hidden";
  const seen = tip && within(tip, chart.frame.side);
  const [x, y] = tip ?? [0, 0];
  set(chart.vector, { x1: chart.frame.x(0), y1: chart.frame.y(0), x2: x, y2: y, visibility: hidden });
  set(chart.tip, { cx: x, cy: y, visibility: seen ? null : "hidden" });
}

/** The position whose force lies nearest to the pointer; null where all are farther away than `far` px. */
function closest(chart, event, far) {
  const box = chart.plot.getBoundingClientRect();
  const grow = chart.frame.width / box.width;
  const [px, py] = [(event.clientX - box.left) * grow, (event.clientY - box.top) * grow];
  let best = far === Infinity ? chart.index : null;
  let least = far;
  for (let index = 0; index < chart.scene.count; index += 1) {
    const place = spot(chart, chart.joint.reaction, index);
    const gap = place ? Math.hypot(place[0] - px, place[1] - py) : Infinity;
    if (gap < least) [best, least] = [index, gap];
  }
  return best;
}
