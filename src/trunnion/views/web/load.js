// Loads in the drawing: a force as an arrow at its point, a moment as a bent one on its link. Their length is no scale.

import { arrow, bentArrow } from "./arrow.js";
import { set, svg } from "./dom.js";
import { stated } from "./format.js";

const LENGTH = 44; // px
const RADIUS = 19; // px

/**
 * What can be drawn of the loads, [{keys, node, aim}]; a load stands at the middle of the points `keys`. `aim`, of a
 * force that follows its link, turns it with the link's angle.
 */
export function loadsOf(scene) {
  return scene.loads.flatMap((load) => {
    const body = scene.links.find((link) => link.name === load.link)?.points ?? [];
    const parts = [];
    if (load.at && Math.hypot(...load.force) > 0) parts.push({ keys: [load.at], ...force(load) });
    if (load.moment && body.length) parts.push({ keys: load.at ? [load.at] : body, node: moment(load) });
    return parts;
  });
}

function force({ name, force: [x, y], frame, varies, link }) {
  const text = value(Math.hypot(x, y), "N", varies);
  const [shaft, label] = [svg("path"), svg("text", { dy: "0.32em" }, text)];
  const aim = (angle) => {
    const direction = Math.atan2(y, x) + angle;
    const [dx, dy] = [LENGTH * Math.cos(direction), -LENGTH * Math.sin(direction)];
    const left = dx < -0.3 * LENGTH;
    set(shaft, { d: arrow(0, 0, dx, dy) });
    set(label, { x: dx + (left ? -8 : 8), y: dy, class: left ? "end" : null });
  };
  aim(0);
  const node = svg("g", { class: "load" }, svg("title", {}, `${name}: ${text}`), shaft, label);
  return { node, aim: frame === "link" ? aim : null, link };
}

/** A load's size; of one that varies, its largest. */
function value(size, unit, varies) {
  return varies ? `≤ ${stated(size, unit)}` : stated(size, unit);
}

function moment({ name, moment: size, varies }) {
  const { shaft, head } = bentArrow(RADIUS, size);
  const side = size > 0 ? 1 : -1; // beside the arc, away from its head
  const label = { x: side * (RADIUS + 8), y: 2, dy: "0.32em", class: side < 0 ? "end" : null };
  const text = value(size, "N m", varies);
  return svg(
    "g",
    { class: "load" },
    svg("title", {}, `${name}: ${text}`),
    svg("path", { class: "arc", d: shaft }),
    svg("path", { d: head }),
    svg("text", label, text),
  );
}

/** Put a load to the middle of the places of its points. */
export function poseLoad({ keys, node }, spots) {
  const known = spots.length === keys.length;
  const middle = [0, 1].map((axis) => spots.reduce((sum, spot) => sum + spot[axis], 0) / spots.length);
  set(node, {
    transform: known ? `translate(${middle[0].toFixed(1)},${middle[1].toFixed(1)})` : null,
    visibility: known ? null : "hidden",
  });
}
