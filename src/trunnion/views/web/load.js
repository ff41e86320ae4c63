// Loads in the drawing: a force as an arrow at its point, a moment as a bent one on its link. Their length is no scale.

import { arrow, bentArrow } from "./arrow.js";
import { set, svg } from "./dom.js";
import { stated } from "./format.js";

const LENGTH = 44; // px
const RADIUS = 19; // px
const CHARACTER = 7.6; // px, a wide mean of the labels' letters, until the browser tells
const NONE = 1e-9; // of the largest value: a load that is less is none
const EDGE = 5; // px between a label and the edge of the picture

/**
 * What can be drawn of the loads, [{keys, node, aim, label}]; a load stands at the middle of the points `keys`. `aim(angle,
 * index)` turns a force that follows its link with the link's angle, and shows one that varies as it is at a position.
 */
export function loadsOf(scene) {
  return scene.loads.flatMap((load) => {
    const body = scene.links.find((link) => link.name === load.link)?.points ?? [];
    const parts = [];
    if (load.at && Math.hypot(...load.force) > 0) parts.push({ keys: [load.at], ...force(load) });
    if (load.moment && body.length) parts.push({ keys: load.at ? [load.at] : body, ...moment(load) });
    return parts;
  });
}

function force({ name, force: stated_, frame, varies, course, link }) {
  const parts = drawn(name, "N");
  const [shaft] = parts.paths;
  const aim = (angle, index) => {
    const [x, y] = now(course?.force, index) ?? stated_;
    const direction = Math.atan2(y, x) + (frame === "link" ? angle : 0);
    const [dx, dy] = [LENGTH * Math.cos(direction), -LENGTH * Math.sin(direction)];
    set(shaft, { d: arrow(0, 0, dx, dy) });
    Object.assign(parts.label, { tip: [dx, dy], left: dx < -0.3 * LENGTH });
    parts.say(Math.hypot(x, y), varies && !course, Math.hypot(...stated_));
  };
  aim(0, 0);
  return { ...parts, aim: frame === "link" || course ? aim : null, link };
}

function moment({ name, moment: size, varies, course, link }) {
  const parts = drawn(name, "N m", "arc");
  const aim = (_, index) => {
    const [here] = now(course?.moment, index) ?? [size];
    const { shaft, head } = bentArrow(RADIUS, here);
    [shaft, head].forEach((d, order) => set(parts.paths[order], { d }));
    const side = here > 0 ? 1 : -1; // beside the arc, away from its head
    Object.assign(parts.label, { tip: [side * RADIUS, 2], left: side < 0 });
    parts.say(Math.abs(here), varies && !course, Math.abs(size));
  };
  aim(0, 0);
  return { ...parts, aim: course ? aim : null, link };
}

/** The components of a load that varies at a position, 0 where it has no value; null of one that does not vary. */
function now(components, index) {
  return components?.length ? components.map((values) => values[index] || 0) : null;
}

/** The nodes of a load, and `say(size, most, peak)`: its size, of one that is not known at each position its largest. */
function drawn(name, unit, kind) {
  const title = svg("title");
  const paths = kind ? [svg("path", { class: kind }), svg("path")] : [svg("path")];
  const label = { node: svg("text", { dy: "0.32em" }), size: 0, measured: 0, tip: [0, 0], left: false };
  const node = svg("g", { class: "load" }, title, ...paths, label.node);
  let said = "";
  const say = (size, most, peak) => {
    const words = `${most ? "≤ " : ""}${stated(size, unit)}`;
    if (words === said) return;
    said = words;
    title.textContent = `${name}: ${words}`;
    label.node.textContent = words;
    Object.assign(label, { size: words.length * CHARACTER, measured: 0 });
    node.classList.toggle("no-load", size <= NONE * peak); // nothing acts here
  };
  return { node, paths, label, say };
}

/** Set a label beside the tip of its load; where it would leave the picture, inside it and clear of the tip. */
function settle(label, /** @type {number[]} */ [x, y], { width, height }) {
  label.measured ||= label.node.getComputedTextLength?.() ?? 0;
  const { node, left } = label;
  const [dx, dy] = label.tip;
  const size = label.measured || label.size;
  const wanted = left ? dx - 8 - size : dx + 8;
  const start = Math.max(Math.min(wanted, width - EDGE - size - x), EDGE - x);
  const clear = start === wanted ? dy : dy + (dy > 0 ? 14 : -14);
  set(node, {
    x: left ? start + size : start,
    y: Math.max(Math.min(clear, height - EDGE - 6 - y), EDGE + 6 - y),
    class: left ? "end" : null,
  });
}

/** Put a load to the middle of the places of its points, in a picture of a width and height. */
export function poseLoad({ keys, node, label }, spots, room) {
  const known = spots.length === keys.length;
  const middle = [0, 1].map((axis) => spots.reduce((sum, spot) => sum + spot[axis], 0) / spots.length);
  set(node, {
    transform: known ? `translate(${middle[0].toFixed(1)},${middle[1].toFixed(1)})` : null,
    visibility: known ? null : "hidden",
  });
  if (known) settle(label, middle, room);
}
