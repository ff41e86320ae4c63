// Loads in the drawing: a force as an arrow at its point, a moment as a bent one on its link. Their length is no scale.

import { arrow, bentArrow } from "./arrow.js";
import { at, guide } from "./data.js";
import { set, svg } from "./dom.js";
import { stated } from "./format.js";

const LENGTH = 44; // px
const RADIUS = 19; // px
const CHARACTER = 7.6; // px, a wide mean of the labels' letters, until the browser tells
const EDGE = 5; // px between a label and the edge of the picture

/**
 * What can be drawn of the loads, [{name, keys, node, aim, label}]; a load stands at the middle of the points `keys`.
 * `aim(index)` turns it as it is at a position of a scene of the same structure.
 */
export function loadsOf(scene) {
  return scene.loads.flatMap((load) => {
    const body = scene.links.find((link) => link.name === load.link)?.points ?? [];
    const parts = [];
    const [x, y] = load.force ?? [0, 0];
    const turned = (now, index) => (load.frame === "link" ? (at(now.links.find((link) => link.name === load.link).angle, index) ?? 0) : 0);
    if (load.at && Math.hypot(x, y) > 0)
      parts.push({ keys: [load.at], ...force(load, Math.hypot(x, y), (now, index) => Math.atan2(y, x) + turned(now, index)) });
    if (load.moment && body.length) parts.push({ keys: load.at ? [load.at] : body, ...moment(load, load.moment, () => load.moment) });
    return [...parts, ...resisting(scene, load)];
  });
}

/** What opposes the motion of a joint, on its second link; it is hidden where it does not act. */
function resisting(scene, load) {
  const joint = load.resists && scene.joints.find(({ name }) => name === load.joint);
  if (!joint) return [];
  const sense = (now, index) => at(now.loads.find(({ name }) => name === load.name)?.acts, index) || null;
  if (joint.type !== "prismatic") return [{ keys: [joint.at], ...moment(load, load.resists, sense) }];
  const angle = (now, index) => sense(now, index) && guide(now, joint, index) + (sense(now, index) < 0 ? Math.PI : 0);
  return [{ keys: [joint.at], ...force(load, load.resists, angle) }];
}

/** An arrow in the direction angle(scene, index), rad; null where it does not act. */
function force({ name, varies }, size, angle) {
  const text = value(size, "N", varies);
  const shaft = svg("path");
  const label = { node: svg("text", { dy: "0.32em" }, text), size: text.length * CHARACTER, tip: [0, 0], left: false };
  const node = svg("g", { class: "load" }, svg("title", {}, `${name}: ${text}`), shaft, label.node);
  const aim = (scene, index) => {
    const direction = angle(scene, index);
    const [dx, dy] = [LENGTH * Math.cos(direction), -LENGTH * Math.sin(direction)];
    set(node, { display: direction === null ? "none" : null });
    set(shaft, { d: arrow(0, 0, dx, dy) });
    Object.assign(label, { tip: [dx, dy], left: dx < -0.3 * LENGTH });
  };
  return { name, node, aim, label };
}

/** A load's size; of one that varies, its largest. */
function value(size, unit, varies) {
  return varies ? `≤ ${stated(size, unit)}` : stated(size, unit);
}

/** A bent arrow counter-clockwise where sense(scene, index) is positive; null where it does not act. */
function moment({ name, varies }, size, sense) {
  const text = value(size, "N m", varies);
  const [words, arc, tip] = [svg("text", { dy: "0.32em" }, text), svg("path", { class: "arc" }), svg("path")];
  const label = { node: words, size: text.length * CHARACTER, tip: [0, 2], left: false };
  const node = svg("g", { class: "load" }, svg("title", {}, `${name}: ${text}`), arc, tip, words);
  const aim = (scene, index) => {
    const way = sense(scene, index);
    const { shaft, head } = bentArrow(RADIUS, way);
    set(node, { display: way === null ? "none" : null });
    set(arc, { d: shaft });
    set(tip, { d: head });
    const side = way > 0 ? 1 : -1; // beside the arc, away from its head
    Object.assign(label, { tip: [side * RADIUS, 2], left: side < 0 });
  };
  return { name, node, aim, label };
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
