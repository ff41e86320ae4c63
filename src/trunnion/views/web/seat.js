// Seat diagram of one end of a joint: the pin in its hole, the play magnified by what is written beside it.

import { jumpsAt, told } from "./built.js";
import { at, full, peak } from "./data.js";
import { arrow } from "./arrow.js";
import { figure, html, onWidth, set, svg } from "./dom.js";
import { prefixed, quantity, short } from "./format.js";

const PIN = 1.1; // radius of the pin as drawn, of the clearance: the radii are not to scale, the play is
const ARROW = 0.9; // length of the largest load
const ROOM = PIN + 1 + ARROW + 0.4; // half the width of the diagram
const MARGIN = { top: 6, right: 6, bottom: 36, left: 46 };
const PIXEL = 0.0254 / 96; // m on a screen

/** The diagrams of every seat, [{element, show}]; `kinds` colours joints. */
export function seatCharts(scene, kinds) {
  return (scene.built?.seats ?? []).flatMap((seat) => {
    const kind = kinds.get(seat.joint);
    if (seat.kind === "ball") return [["x", "y"], ["x", "z"]].map((plane) => diagram(scene, seat, 0, plane, kind)); // prettier-ignore
    if (flat(seat)) return [diagram(scene, seat, 0, ["x", "y"], kind)];
    return seat.ends.map((_, end) => diagram(scene, seat, end, ["x", "y"], kind));
  });
}

/** Whether it is a guide of the plane: a bar between two walls. */
function flat({ kind, ends }) {
  return kind === "guide" && !("z" in ends[0].offset);
}

function diagram(scene, seat, end, plane, kind) {
  const plot = html("div", { class: "plot" });
  const value = html("span", { class: "value" }, "—");
  const remark = html("p", { class: "remark" });
  const ends = seat.ends.length > 1 && !flat(seat) ? `, end ${end + 1}` : "";
  const title = seat.joint + (seat.kind === "ball" ? `: ${plane.join("")}` : ends);
  const scale = prefixed(seat.clearance, "m");
  const loads = seat.ends.map(({ force }) => sizes(force, scene.count));
  const chart = { scene, seat, end, plane, kind, plot, remark, scale, index: 0, most: peak(...loads) };
  const element = figure("chart polar seat", title, scale.unit, value, plot, remark);
  onWidth(plot, (width) => draw(chart, width), 220);
  return {
    element,
    show(index) {
      chart.index = index;
      value.textContent = loads[end][index] === null ? "—" : quantity(loads[end][index], "N", chart.most);
      move(chart);
    },
  };
}

/** Size of a force of which an axis may have no value, for every position. */
function sizes(force, count) {
  const parts = Object.values(force).map((series) => full(series, count));
  return Array.from({ length: count }, (_, index) => {
    const known = parts.map((part) => part[index]).filter((part) => part !== null);
    return known.length ? Math.hypot(...known) : null;
  });
}

function draw(chart, width) {
  const { seat, scale, kind } = chart;
  const side = width - MARGIN.left - MARGIN.right;
  const unit = side / (2 * ROOM * seat.clearance); // px a metre
  const middle = [MARGIN.left + side / 2, MARGIN.top + side / 2];
  chart.frame = { side, unit, middle, rho: seat.clearance * unit, to: ([x, y]) => [middle[0] + x * unit, middle[1] - y * unit] };
  const rho = chart.frame.rho;
  chart.pin = flat(seat) ? svg("path", { class: `pin-bar ${kind}` }) : shape(seat, PIN * rho, { class: `pin-body ${kind}` });
  chart.centre = svg("circle", { class: `dot ${kind}`, r: 4 });
  chart.load = svg("path", { class: `reaction ${kind}` });
  const walls = flat(seat) ? [svg("path", { class: "hole", d: bars(chart) })] : [
    shape(seat, (1 + PIN) * rho, { class: "hole" }, middle),
    shape(seat, rho, { class: "reach" }, middle),
  ]; // prettier-ignore
  const ticks = [-1, 0, 1].flatMap((step) => {
    const text = told(step * seat.clearance * scale.factor, 3);
    const up = svg("text", { class: "tick end", x: MARGIN.left - 6, y: middle[1] - step * rho, dy: "0.32em" }, text);
    const across = svg("text", { class: "tick middle", x: middle[0] + step * rho, y: MARGIN.top + side + 14 }, text);
    return flat(seat) ? [up] : [up, across];
  });
  const along = flat(seat) ? `length ${quantity(seat.length, "m")}, not to scale` : chart.plane[0];
  const labels = [
    svg("text", { class: "axis middle", x: middle[0], y: MARGIN.top + side + 30 }, along),
    svg("text", { class: "axis", x: 0, y: MARGIN.top + 10 }, chart.plane[1]),
  ];
  const height = side + MARGIN.top + MARGIN.bottom;
  const cross = svg("path", { class: "zero", d: `M${middle[0] - 5},${middle[1]}h10m-5,-5v10` });
  chart.plot.replaceChildren(
    svg(
      "svg",
      { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `Seat of joint ${seat.joint}, end ${chart.end + 1}` },
      ...walls, cross, chart.pin,
      flat(seat) ? null : svg("path", { class: `curve ${kind}`, d: locus(chart) }),
      chart.load, chart.centre, ...ticks, ...labels,
    ), // prettier-ignore
  );
  chart.remark.textContent = `${seat.kind} of ${short(seat.links[0])} in ${short(seat.links[1])}, play × ${told(unit * PIXEL)}; longest load ${quantity(chart.most, "N")}`;
  move(chart);
}

/** A circle, of a guide in space a square; around a middle, or to be moved. */
function shape({ kind }, half, attributes, /** @type {number[]} */ [x, y] = [0, 0]) {
  const size = { width: 2 * half, height: 2 * half };
  return kind === "guide"
    ? svg("rect", { ...attributes, x: x - half, y: y - half, ...size })
    : svg("circle", { ...attributes, cx: x, cy: y, r: half });
}

/** The walls between which the bar of a guide lies, as its middle line sees them. */
function bars({ frame: { middle, side, rho } }) {
  const half = side * 0.42;
  return [1, -1].map((sign) => `M${middle[0] - half},${middle[1] + sign * rho}h${2 * half}`).join("");
}

function offset({ seat, end, plane, frame }, index) {
  const place = plane.map((axis) => at(seat.ends[end].offset[axis], index));
  return place.includes(null) ? null : frame.to(place);
}

/** The track of the pin's centre, lifted where it jumps. */
function locus(chart) {
  const { scene, frame } = chart;
  let [path, last] = ["", null];
  for (let index = 0; index < scene.count + (scene.abscissa.closed ? 1 : 0); index += 1) {
    const spot = offset(chart, index % scene.count);
    if (spot) path += `${jumpsAt(last, spot, frame.rho) ? "M" : "L"}${spot.map((part) => part.toFixed(1))}${last ? "" : "h0"}`;
    last = spot;
  }
  return path;
}

function move(chart) {
  const { frame, seat, end, plane, index } = chart;
  if (!frame) return;
  if (flat(seat)) return moveBar(chart);
  const spot = offset(chart, index);
  const hidden = spot ? null : "hidden";
  for (const part of [chart.pin, chart.centre, chart.load]) set(part, { visibility: hidden });
  if (!spot) return;
  const shift = spot.map((part) => part.toFixed(1));
  set(chart.pin, { transform: `translate(${shift})` });
  set(chart.centre, { cx: shift[0], cy: shift[1] });
  const force = plane.map((axis) => at(seat.ends[end].force[axis], index));
  const way = [spot[0] - frame.middle[0], spot[1] - frame.middle[1]];
  const far = Math.hypot(...way) || 1;
  const start = spot.map((part, axis) => part + (way[axis] / far) * PIN * frame.rho);
  const length = (ARROW * frame.rho) / (chart.most || 1);
  set(chart.load, { d: force.includes(null) ? "" : arrow(...start, force[0] * length, -force[1] * length) });
}

function moveBar(chart) {
  const { frame, seat, index } = chart;
  const half = frame.side * 0.42;
  const ends = seat.ends.map(({ offset: { y }, force }, end) => {
    const [place, load] = [at(y, index), at(force.y, index)];
    return place === null ? null : { x: frame.middle[0] + (end ? half : -half), y: frame.middle[1] - place * frame.unit, load };
  });
  const known = !ends.includes(null);
  set(chart.pin, { d: known ? `M${ends.map(({ x, y }) => `${x.toFixed(1)},${y.toFixed(1)}`).join("L")}` : "" });
  set(chart.centre, { visibility: "hidden" });
  const length = (ARROW * frame.rho) / (chart.most || 1);
  set(chart.load, { d: known ? ends.map(({ x, y, load }) => arrow(x, y, 0, -(load ?? 0) * length)).join("") : "" });
}
