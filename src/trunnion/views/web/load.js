// Loads in the drawing: a force as an arrow at its point, a moment as a bent one on its link. Their length is no scale.

import { arrow, bentArrow } from "./arrow.js";
import { set, svg } from "./dom.js";
import { stated } from "./format.js";

const LENGTH = 44; // px
const RADIUS = 19; // px
const CHARACTER = 7.6; // px, a wide mean of the labels' letters, until the browser tells
const EDGE = 5; // px between a label and the edge of the picture

/**
 * What can be drawn of the loads, [{keys, node, aim, label}]; a load stands at the middle of the points `keys`. `aim`, of a
 * force that follows its link, turns it with the link's angle.
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

function force({ name, force: [x, y], frame, varies, link }) {
  const text = value(Math.hypot(x, y), "N", varies);
  const shaft = svg("path");
  const label = { node: svg("text", { dy: "0.32em" }, text), size: text.length * CHARACTER, tip: [0, 0], left: false };
  const aim = (angle) => {
    const direction = Math.atan2(y, x) + angle;
    const [dx, dy] = [LENGTH * Math.cos(direction), -LENGTH * Math.sin(direction)];
    set(shaft, { d: arrow(0, 0, dx, dy) });
    Object.assign(label, { tip: [dx, dy], left: dx < -0.3 * LENGTH });
  };
  aim(0);
  const node = svg("g", { class: "load" }, svg("title", {}, `${name}: ${text}`), shaft, label.node);
  return { node, aim: frame === "link" ? aim : null, link, label };
}

/** A load's size; of one that varies, its largest. */
function value(size, unit, varies) {
  return varies ? `≤ ${stated(size, unit)}` : stated(size, unit);
}

function moment({ name, moment: size, varies }) {
  const { shaft, head } = bentArrow(RADIUS, size);
  const side = size > 0 ? 1 : -1; // beside the arc, away from its head
  const text = value(size, "N m", varies);
  const words = svg("text", { dy: "0.32em" }, text);
  const node = svg(
    "g",
    { class: "load" },
    svg("title", {}, `${name}: ${text}`),
    svg("path", { class: "arc", d: shaft }),
    svg("path", { d: head }),
    words,
  );
  return { node, label: { node: words, size: text.length * CHARACTER, tip: [side * RADIUS, 2], left: side < 0 } };
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
