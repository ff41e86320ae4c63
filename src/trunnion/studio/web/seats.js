// Pins in their holes on the sheet, the play magnified: the way of the pin's centre over the cycle, where it touches, the
// normal there and the load.

import { arrow } from "../web/arrow.js";
import { hole, jumpsAt, leaning } from "../web/built.js";
import { angleAt, at, guide, place } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { quantity } from "../web/format.js";
import { perNewton } from "./drawing.js";
import * as state from "./state.js";

const PIN = 5; // px, radius of a pin as it is drawn
const BLOCK = 10; // px, half the height of a block
const NORMAL = 16; // px beyond the contact

/** What is drawn of the seats of the joints that are loose, at the present position. */
export function pinsInHoles(view, seats, wanted, words) {
  const scale = wanted.reactions ? perNewton(view) : 0;
  return seats.flatMap((seat) => {
    const joint = view.scene.joints.find(({ name }) => name === seat.joint);
    const middle = joint && place(view.scene, joint.at, view.exact);
    if (!middle) return [];
    const parts = seat.kind === "guide" ? inGuide(view, joint, seat, scale) : inHole(view, joint, seat, scale);
    const chosen = state.selection.peek()?.name === joint.name;
    if (!parts.length || !(wanted.values || chosen)) return parts;
    const [x, y] = view.frame.to(middle);
    return [...parts, words(x + 14, y + PIN + unitOf(view) * seat.clearance + 22, telling(view, joint, seat))];
  });
}

/** px a metre of play. */
const unitOf = ({ frame, scene }) => frame.scale * scene.factor;

/** The angle of the axes of a hole, rad, as it is: errors turn no offset. */
function axesOf({ scene: { of: scene }, exact: index }, joint) {
  const link = scene.links.find(({ name }) => name === joint.links[1]);
  return joint.type === "prismatic" ? guide(scene, joint, index) : (angleAt(link.angle, index) ?? 0);
}

const valueAt = ({ x, y }, index) => {
  const value = [at(x, index), at(y, index)];
  return value.includes(null) ? null : value;
};

function turned(/** @type {number[]} */ [x, y], angle) {
  return [x * Math.cos(angle) - y * Math.sin(angle), x * Math.sin(angle) + y * Math.cos(angle)];
}

const directionOf = (/** @type {number[]} */ [x, y]) => Math.atan2(y, x);

/** "20.00 µm towards 47.3°, 114.2 N", of a guide by its ends. */
function telling(view, joint, { ends, kind }) {
  const { exact: index } = view;
  return ends.map(({ offset, force }, end) => {
    const [by, load] = [offset, force].map((one) => valueAt(one, index));
    const way = kind === "guide" || !by ? "" : ` towards ${quantity(directionOf(turned(by, axesOf(view, joint))), "rad")}`;
    const size = by ? quantity(kind === "guide" ? by[1] : Math.hypot(...by), "m") : "—";
    return `${ends.length > 1 ? `end ${end + 1}: ` : `${joint.name}: `}${size}${way}, ${load ? quantity(Math.hypot(...load), "N") : "—"}`;
  }).join("; "); // prettier-ignore
}

function inHole(view, joint, seat, scale) {
  const { frame, exact: index, scene, kinds } = view;
  const [{ offset, force }] = seat.ends;
  const [by, load] = [offset, force].map((one) => valueAt(one, index));
  const [unit, angle] = [unitOf(view), axesOf(view, joint)];
  const [x, y] = frame.to(hole(scene, joint, index) ?? place(scene, joint.at, index));
  seat.path ??= svg("path", { class: "way-of-pin", d: way(offset, scene, seat.clearance), "vector-effect": "non-scaling-stroke" }); // once: it is long
  const [c, s] = [unit * Math.cos(angle), unit * Math.sin(angle)];
  const path = set(seat.path, { transform: `matrix(${c},${-s},${-s},${-c},${x},${y})` });
  if (!by) return [path];
  const size = Math.hypot(...by);
  const [ux, uy] = size > 0 ? turned(by, angle).map((part) => part / size) : [0, 0];
  const far = PIN + unit * seat.clearance; // to the wall of the hole
  const touch = [x + ux * far, y - uy * far];
  const pressed = load && turned(load, angle).map((part) => part * scale);
  const touches = size > 0.99 * seat.clearance;
  const normal = `M${x + unit * ux * size},${y - unit * uy * size}L${x + ux * (far + NORMAL)},${y - uy * (far + NORMAL)}`;
  return [path, ...(touches ? [svg("path", { class: "normal-of-contact", d: normal })] : []), ...loaded(kinds.get(joint.name), touch, pressed, touches)];
}

/** Where a load presses, and the load, px upwards. */
function loaded(kind, /** @type {number[]} */ [x, y], pressed, touches) {
  const vector = pressed && svg("path", { class: `reaction ${kind}`, d: arrow(x, y, pressed[0], -pressed[1]) });
  return [vector, touches && svg("circle", { class: "contact", cx: x.toFixed(2), cy: y.toFixed(2), r: 2.6 })].filter(Boolean);
}

/** The way of the pin's centre in its hole, in metres; lifted where it jumps across. */
function way(offset, { count, abscissa }, clearance) {
  let [path, last] = ["", null];
  for (let index = 0; index < count + (abscissa.closed ? 1 : 0); index += 1) {
    const spot = valueAt(offset, index % count);
    if (spot) path += `${jumpsAt(last, spot, clearance) ? "M" : "L"}${spot.map((part) => part.toPrecision(7)).join()}`;
    last = spot;
  }
  return path;
}

/** A block between its walls: the rail lies aside in the block by the offset of an end, and touches the other side of the block. */
function inGuide(view, joint, seat, scale) {
  const { frame, scene, exact: index, kinds } = view;
  const [axis, drawn] = [axesOf(view, joint), guide(scene, joint, index) + leaning(scene, joint, index)];
  const [x, y] = frame.to(place(scene, joint.at, index));
  return seat.ends.flatMap(({ offset, force }, end) => {
    const [by, load] = [offset, force].map((one) => valueAt(one, index));
    if (!by) return [];
    const side = by[1] > 0 ? -1 : 1;
    const [dx, dy] = turned([(end ? 0.5 : -0.5) * seat.length * frame.scale, side * BLOCK], drawn);
    const pressed = load && turned(load, axis).map((part) => part * scale);
    return loaded(kinds.get(joint.name), [x + dx, y - dy], pressed, Math.abs(by[1]) > 0.99 * seat.clearance);
  });
}
