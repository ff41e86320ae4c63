// A line chart over the drive: axes, curves with gaps, shaded positions without an answer, a cursor that follows.

import { domain, extent, gaps, lost, nearest, outside, peak, usualPeak } from "./data.js";
import { clipped, figure, html, onWidth, set, svg } from "./dom.js";
import { fixed, prefixed, quantity, tickLabel, ticks } from "./format.js";

const MOST_LINES = 24; // events of a motion that are drawn over the whole height
const LINE = 12; // height of a row of their words
const MARGIN = { top: 8, right: 14, bottom: 40, left: 58 };

/**
 * A chart of `series` [{label, values, kind, quiet, unlisted}] in one unit; `kind` is a class that colours the curve, `quiet`
 * has no dot, `unlisted` no line in the legend; a value that reaches `most` is more than that.
 * `breaks` of a series are positions that no line leads to, `marks` positions that are marked in all of the chart.
 * `band` {low, high, kind, label} is filled. `limits` caps the vertical axis, `free` ends it at the
 * data instead of zero; `note` is a remark below it.
 * `pick(index, firm)` is called when the reader points.
 */
export function lineChart(scene, { title, unit, series, band = null, limits = null, free = false, note = "", marks = [], pick }) {
  const columns = [...series.map((one) => one.values), ...(band ? [band.low, band.high] : [])];
  const scope = limits ? peak(limits) : usualPeak(scene, ...columns);
  const scale = prefixed(scope, unit, scene.units);
  const most = scope * scale.factor;
  const cut = !limits && scope < peak(...columns);
  const remark = [cut ? `The peak of ${quantity(peak(...columns), unit, undefined, scene.units)} ${outside(scene)}` : "", note].filter(Boolean).join(" ");
  const plot = html("div", { class: "plot" });
  const values = series.map(() => html("span", { class: "value" }, "—"));
  const notes = remark ? html("p", { class: "remark" }, remark) : null;
  const element = figure("chart", title, scale.unit, null, legend(series, values, band), plot, notes);
  const chart = {
    scene,
    scale,
    series,
    band,
    marks,
    limits: cut ? [-scope, scope] : limits,
    free,
    title,
    frame: null,
    index: 0,
    plot,
  };
  onWidth(plot, (width) => draw(chart, width), 335);
  listen(chart, pick);
  return {
    element,
    show(index) {
      chart.index = index;
      moveCursor(chart);
      series.forEach((one, order) => {
        const value = one.values[index];
        values[order].textContent = value === null ? "—" : `${value >= one.most ? "> " : ""}${fixed(value * scale.factor, most)}`;
      });
    },
  };
}

function legend(series, values, band) {
  const items = series.flatMap((one, order) =>
    one.unlisted ? [] : [html("li", {}, swatch(one.kind), html("span", { class: "label" }, one.label), values[order])],
  );
  if (band)
    items.push(html("li", {}, html("span", { class: `swatch area ${band.kind}` }), html("span", {}, band.label)));
  return html("ul", { class: "legend" }, ...items);
}

function swatch(kind) {
  return svg(
    "svg",
    { class: "swatch", viewBox: "0 0 22 8", "aria-hidden": "true" },
    svg("line", { x1: 1, x2: 21, y1: 4, y2: 4, class: `curve ${kind}` }),
  );
}

function draw(chart, width) {
  const { scene, scale, series, band } = chart;
  const [x0, x1] = domain(scene.abscissa);
  const [y0, y1] = vertical(chart);
  const right = width - MARGIN.right;
  const x = (value) => MARGIN.left + ((value - x0) / (x1 - x0)) * (right - MARGIN.left);
  const words = labels(scene, x, right);
  const top = MARGIN.top + LINE * Math.max(0, ...words.map((one) => (one ? one.row + 1 : 0)));
  const height = Math.round(Math.min(Math.max(width * 0.46, 190), 270)) + top - MARGIN.top;
  const bottom = height - MARGIN.bottom;
  const frame = {
    width,
    height,
    left: MARGIN.left,
    right,
    top,
    bottom,
    x,
    y: (value) => bottom - ((value - y0) / (y1 - y0)) * (bottom - top),
    back: (px) => x0 + ((px - MARGIN.left) / (right - MARGIN.left)) * (x1 - x0),
  };
  chart.frame = frame;
  chart.cursor = svg("line", { class: "cursor", y1: top, y2: bottom });
  chart.dots = series.map((one) => svg("circle", { class: `dot ${one.kind}`, r: one.quiet ? 0 : 3.2 }));
  const box = { x: MARGIN.left - 2, y: top - 2, width: right - MARGIN.left + 4, height: bottom - top + 4 };
  const curves = series.map((one) =>
    svg("path", { class: `curve ${one.kind}`, d: curvePath(scene, frame, one.values, scale.factor, one.breaks) }),
  );
  const silent = extent(series.map((one) => one.values)) === null;
  const bars = band ? svg("path", { class: `band ${band.kind}`, d: bandPath(chart, band) }) : null;
  chart.plot.replaceChildren(
    svg(
      "svg",
      { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": describe(chart) },
      ...shading(chart, frame),
      ...axes(scene.abscissa, frame, [x0, x1], [y0, y1]),
      ...events(scene, frame, words),
      ...chart.marks.map((index) => mark(frame, scene.abscissa.values[index])),
      clipped(box, ...curves, bars),
      chart.cursor,
      ...chart.dots,
      silent ? svg("text", { class: "mark middle", ...centre(box) }, "no values") : null,
    ),
  );
  moveCursor(chart);
}

/**
 * The words of the events, above the curves: each in the lowest row where it meets no other. None of many, and none of
 * quiet ones, as of impacts, which the curves show: null.
 */
function labels(scene, x, right) {
  const list = scene.motion?.events ?? [];
  const loud = list.filter((one) => !one.quiet).length;
  const ends = []; // of what stands in each row
  return list.map(({ at, word, quiet }) => {
    if (quiet || loud > MOST_LINES) return null;
    const wide = 6 * word.length + 6;
    const left = Math.max(MARGIN.left, Math.min(x(at) - wide / 2, right - wide));
    let row = ends.findIndex((end) => end <= left);
    if (row < 0) row = ends.length;
    ends[row] = left + wide;
    return { word, row, middle: left + wide / 2 };
  });
}

/** The events of a motion in time: a dashed line each; of those without a word, which would hide the curves, a mark on the axis. */
function events(scene, frame, words) {
  const baseline = (row) => frame.top - 4 - LINE * row;
  const lines = (scene.motion?.events ?? []).map(({ at, word }, order) => {
    const x = frame.x(at);
    const y1 = words[order] ? frame.top - 2 : frame.bottom - 7;
    const line = svg("line", { class: words[order] ? "event" : "event many", x1: x, x2: x, y1, y2: frame.bottom });
    line.append(svg("title", {}, word));
    return line;
  });
  const texts = words
    .filter(Boolean)
    .map(({ word, row, middle }) => svg("text", { class: "mark middle", x: middle, y: baseline(row) }, word));
  return [...lines, ...texts];
}

/** A dotted line up through the chart. */
function mark(frame, value) {
  return svg("line", { class: "lost", x1: frame.x(value), x2: frame.x(value), y1: frame.top, y2: frame.bottom });
}

function centre({ x, y, width, height }) {
  return { x: x + width / 2, y: y + height / 2, dy: "0.32em" };
}

/**
 * Ends of the vertical axis in display units: around the data and zero, within the limits if there are any. Shares that
 * stay far from zero, as an efficiency about 0.8, fill the height instead.
 */
function vertical(chart) {
  const { scale, series, band, limits, free } = chart;
  const shown = [...series.map((one) => one.values), ...(band ? [band.low, band.high] : [])];
  let [low, high] = extent(shown) ?? [0, 0];
  if (limits) [low, high] = [Math.max(low, limits[0]), Math.min(high, limits[1])];
  if (limits && low > 0.5 * high && high - low > 1e-6 * high) {
    const middle = (low + high) / 2;
    const half = Math.max(0.6 * (high - low), 0.01 * high);
    return [middle - half, Math.min(middle + half, limits[1])];
  }
  if (!free || !(high > low)) [low, high] = [Math.min(low, 0), Math.max(high, 0)];
  [low, high] = [low * scale.factor, high * scale.factor];
  if (!(high - low > 0)) return limits ? [0, 100] : [low - 1, high + 1];
  const room = 0.05 * (high - low);
  return [low === 0 ? 0 : low - room, high === 0 ? 0 : high + room];
}

function describe(chart) {
  const found = extent(chart.series.map((one) => one.values));
  const span = found
    ? `from ${fixed(found[0] * chart.scale.factor, found[1] * chart.scale.factor)} to ${fixed(found[1] * chart.scale.factor, found[1] * chart.scale.factor)} ${chart.scale.unit}`
    : "no values";
  return `${chart.title} over ${chart.scene.abscissa.label}, ${span}`;
}

function axes(abscissa, frame, [x0, x1], [y0, y1]) {
  const single = abscissa.values.length === 1;
  const across = single ? abscissa.values : ticks(x0, x1, frame.width < 420 ? 5 : 9, abscissa.unit === "°");
  const label = abscissa.unit ? `${abscissa.label} [${abscissa.unit}]` : abscissa.label;
  const middle = (frame.left + frame.right) / 2;
  return [...grid(frame, across, ticks(y0, y1, 6)), svg("text", { class: "axis middle", x: middle, y: frame.bottom + 34 }, label)];
}

/** Lines and numbers of both axes of a frame {left, right, top, bottom, x, y}; crossed: x = 0 is marked as y = 0 is. */
export function grid({ left, right, top, bottom, x, y }, across, up, crossed = false) {
  const step = (list) => (list.length > 1 ? list[1] - list[0] : 1);
  const line = (zero, ends) => svg("line", { class: zero ? "zero" : "grid", ...ends });
  return [
    ...up.map((value) => line(value === 0, { x1: left, x2: right, y1: y(value), y2: y(value) })),
    ...across.map((value) => line(crossed && value === 0, { x1: x(value), x2: x(value), y1: top, y2: bottom })),
    ...up.map((value) => svg("text", { class: "tick end", x: left - 8, y: y(value), dy: "0.32em" }, tickLabel(value, step(up)))),
    ...across.map((value) => svg("text", { class: "tick middle", x: x(value), y: bottom + 16 }, tickLabel(value, step(across)))),
  ];
}

function shading(chart, frame) {
  const { values } = chart.scene.abscissa;
  const half = values.length > 1 ? Math.abs(values[1] - values[0]) / 2 : 0.5;
  const span = (/** @type {number[]} */ [first, last]) => [
    Math.max(frame.x(Math.min(values[first], values[last]) - half), MARGIN.left),
    Math.min(frame.x(Math.max(values[first], values[last]) + half), frame.right),
  ];
  const unsolved = gaps(chart.scene).map((run) => {
    const [low, high] = span(run);
    return svg("rect", {
      class: "unsolved",
      x: low,
      y: frame.top,
      width: Math.max(high - low, 1),
      height: frame.bottom - frame.top,
    });
  });
  const hatched = lost(chart.scene).map((run) => {
    const path = svg("path", { class: "not-valid", d: hatch(...span(run), frame) });
    path.append(svg("title", {}, "not valid: a pin loses contact"));
    return path;
  });
  return [...unsolved, ...hatched];
}

/** Slanted strokes over the height of a chart from x = low to high, at least 3 px wide. */
function hatch(low, high, { top, bottom }) {
  const [left, right] = high - low < 3 ? [(low + high) / 2 - 1.5, (low + high) / 2 + 1.5] : [low, high];
  let path = "";
  for (let y = top + (right - left); y <= bottom; y += 5) path += `M${left} ${y}L${right} ${y - right + left}`;
  return path;
}

/** The path of a curve, broken where there is no value, led on to the first value over a closed turn. */
export function curvePath(scene, frame, values, factor, breaks = []) {
  const { abscissa } = scene;
  const count = abscissa.values.length;
  let path = "";
  let pen = "M";
  let last = null;
  for (let index = 0; index < count + (abscissa.closed ? 1 : 0); index += 1) {
    const value = values[index % count];
    if (value === null) {
      pen = "M";
      continue;
    }
    const y = frame.y(value * factor);
    if ((y < 0 && last > frame.height) || (y > frame.height && last < 0)) pen = "M"; // through infinity, not through the frame
    if (breaks.includes(index % count)) pen = "M";
    last = y;
    const x = abscissa.values[index % count] + (index === count ? abscissa.period : 0);
    path += `${pen}${frame.x(x).toFixed(1)},${y.toFixed(1)}`;
    if (pen === "M") path += "h0"; // a value that stands alone still leaves a dot
    pen = "L";
  }
  return path;
}

/** A bar at each position where the value is an interval. */
function bandPath({ scene, frame, scale }, band) {
  return band.low
    .map((low, index) => {
      const high = band.high[index];
      if (low === null || high === null || !(high > low)) return "";
      const x = frame.x(scene.abscissa.values[index]).toFixed(1);
      return `M${x},${frame.y(low * scale.factor).toFixed(1)}V${frame.y(high * scale.factor).toFixed(1)}`;
    })
    .join("");
}

function moveCursor(chart) {
  const { frame, scene, series, scale, index } = chart;
  if (!frame) return;
  const x = frame.x(scene.abscissa.values[index]);
  set(chart.cursor, { x1: x, x2: x });
  series.forEach((one, order) => {
    const value = one.values[index];
    const y = value === null ? null : frame.y(value * scale.factor);
    const inside = y !== null && y >= 0 && y <= frame.bottom + 2;
    set(chart.dots[order], { cx: x, cy: inside ? y : 0, visibility: inside ? null : "hidden" });
  });
}

/** Pointing moves the crank: a mouse by hovering, a finger or a pressed button by dragging. */
function listen(chart, pick) {
  const point = (event, firm) => {
    if (!chart.frame) return;
    const box = chart.plot.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * chart.frame.width;
    pick(nearest(chart.scene.abscissa, chart.frame.back(x)), firm);
  };
  chart.plot.addEventListener("pointerdown", (event) => point(event, true));
  chart.plot.addEventListener("pointermove", (event) => point(event, event.buttons > 0));
}
