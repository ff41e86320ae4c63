// Loads in the drawing: a force as an arrow at its point on the scale of the reactions, a moment as a bent one on its link.

import { arrow, bentArrow } from "./arrow.js";
import { angleAt, at, guide } from "./data.js";
import { set, svg } from "./dom.js";
import { stated } from "./format.js";

const LENGTH = 44; // px, of a force where no reaction gives a scale
const LEAST = 12; // px, of a force that is small beside the reactions
const RADIUS = 19; // px
const CHARACTER = 7.6; // px, a wide mean of the labels' letters, until the browser tells
const EDGE = 5; // px between a label and the edge of the picture

/**
 * What can be drawn of the loads, [{name, keys, node, aim, label}]; a load stands at the middle of the points `keys`.
 * `aim(scene, index, perNewton)` makes it what it is at a position of a scene of the same structure, hidden where it does
 * not act, and tells whether it acts; `force(scene, index)` is that of a force, [x, y] N.
 */
export function loadsOf(scene) {
  return scene.loads.flatMap((load) => {
    const body = scene.links.find((link) => link.name === load.link)?.points ?? [];
    const joint = load.resists ? scene.joints.find(({ name }) => name === load.joint) : null;
    const parts = [];
    if (load.at && Math.hypot(...load.force) > 0) parts.push({ keys: [load.at], ...force(load, pushed) });
    if (load.moment && body.length) parts.push({ keys: load.at ? [load.at] : body, ...moment(load, turned) });
    if (joint) parts.push({ keys: [joint.at], ...(joint.type === "prismatic" ? force(load, (...now) => along(joint, ...now)) : moment(load, opposed)) });
    return parts;
  });
}

/** The components of a load's `force`, its `moment` or what it `resists` at a position: of one that varies those there. */
function present(load, key, index) {
  const course = load.course?.[key];
  return course ? course.map((values) => at(values, index)) : [load[key] ?? 0].flat();
}

/** A force in the plane as {size, angle}, N and rad. */
function pushed(scene, load, index) {
  const [x, y] = present(load, "force", index);
  const link = load.frame === "link" ? scene.links.find(({ name }) => name === load.link) : null;
  return { size: Math.hypot(x, y), angle: Math.atan2(y, x) + (link ? (angleAt(link.angle, index) ?? 0) : 0) };
}

/** A moment, N m; positive counter-clockwise. */
function turned(_, load, index) {
  return present(load, "moment", index)[0];
}

/** What opposes the motion of a joint, on its second link: N m or N. */
function opposed(_, load, index) {
  return present(load, "resists", index)[0] * at(load.acts, index);
}

function along(joint, scene, load, index) {
  const size = opposed(scene, load, index);
  return { size: Math.abs(size), angle: guide(scene, joint, index) + (size < 0 ? Math.PI : 0) };
}

function force(load, course) {
  const shaft = svg("path");
  const put = (scene, one, index, label, perNewton) => {
    const { size, angle } = course(scene, one, index);
    const length = perNewton > 0 ? Math.max(size * perNewton, LEAST) : LENGTH;
    const [dx, dy] = [length * Math.cos(angle), -length * Math.sin(angle)];
    set(shaft, { d: arrow(0, 0, dx, dy) });
    Object.assign(label, { tip: [dx, dy], left: dx < -0.3 * length });
    return size;
  };
  const vector = (scene, index) => {
    const { size, angle } = course(scene, load, index);
    return [size * Math.cos(angle), size * Math.sin(angle)];
  };
  return { ...part(load, "N", [shaft], put), force: vector };
}

function moment(load, course) {
  const [arc, tip] = [svg("path", { class: "arc" }), svg("path")];
  const put = (scene, one, index, label) => {
    const size = course(scene, one, index);
    const { shaft, head } = bentArrow(RADIUS, size);
    set(arc, { d: shaft });
    set(tip, { d: head });
    const side = size > 0 ? 1 : -1; // beside the arc, away from its head
    Object.assign(label, { tip: [side * RADIUS, 2], left: side < 0 });
    return Math.abs(size);
  };
  return part(load, "N m", [arc, tip], put);
}

/** A part of the drawing with its label; `put(scene, load, index, label)` shapes it and returns its size. */
function part({ name, varies, course }, unit, shapes, put) {
  const [words, title] = [svg("text", { dy: "0.32em" }), svg("title")];
  const label = { node: words, size: 0, measured: 0, tip: [0, 0], left: false };
  const node = svg("g", { class: "load", "data-kind": "loads", "data-name": name }, title, ...shapes, words);
  const most = varies && !course ? "≤ " : ""; // of one whose course is not known its largest
  const aim = (scene, index, perNewton) => {
    const size = put(scene, scene.loads.find((one) => one.name === name) ?? {}, index, label, perNewton);
    const text = `${most}${stated(size, unit)}`;
    set(node, { display: size > 0 ? null : "none" });
    if (text !== words.textContent) {
      words.textContent = text;
      title.textContent = `${name}: ${text}`;
      Object.assign(label, { size: text.length * CHARACTER, measured: 0 });
    }
    return size > 0;
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
  const line = Math.max(Math.min(clear, height - EDGE - 6 - y), EDGE + 6 - y);
  set(node, { x: left ? start + size : start, y: line, class: left ? "end" : null });
  return { left: x + start, right: x + start + size, top: y + line - 8, bottom: y + line + 7, y: y + line + 4 };
}

/** Put a load to the middle of the places of its points; returns where its value stands, null where there is none. */
export function poseLoad(load, { scene, spots: spotsOf, index, perNewton, room }) {
  const { keys, node, label } = load;
  const acts = load.aim(scene, index, perNewton);
  const spots = spotsOf(keys);
  const known = spots.length === keys.length;
  const middle = [0, 1].map((axis) => spots.reduce((sum, spot) => sum + spot[axis], 0) / spots.length);
  set(node, {
    transform: known ? `translate(${middle[0].toFixed(1)},${middle[1].toFixed(1)})` : null,
    visibility: known ? null : "hidden",
  });
  const box = known ? settle(label, middle, room) : null;
  return acts ? box : null;
}
