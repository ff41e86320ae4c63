// Dimensions on the sheet: lengths between the points of each link, distances and angles of what is fixed.

import { guide, hull, place } from "../web/data.js";
import { svg } from "../web/dom.js";
import { stated } from "../web/format.js";
import * as state from "./state.js";

const ASIDE = 24; // px between a link and its dimension line
const GAP = 9; // px between a point and its extension line
const TICK = 5; // px
const ARC = 44; // px, radius of the arc of an angle
const SHORT = 30; // px: shorter dimensions have no room for their words
const LEVEL = 1e-6; // rad: less is none

/** What is dimensioned at the shown position: [{name, ends: [[x, y], [x, y]]}] m, of each link and of the ground. */
export function lengthsOf(scene, index) {
  return scene.links.flatMap((link) => {
    const spots = apart(link.points.map((key) => (link.ground && slides(scene, key) ? null : place(scene, key, index))).filter(Boolean));
    const closed = !link.ground && spots.length > 2 && hull(spots).length > 2;
    const order = closed ? hull(spots) : [...spots].sort(([x, y], [a, b]) => x - a || y - b);
    const ends = order.slice(1).map((spot, k) => [order[k], spot]);
    if (closed) ends.push([order[order.length - 1], order[0]]);
    const middle = closed ? [0, 1].map((axis) => spots.reduce((sum, spot) => sum + spot[axis], 0) / spots.length) : null;
    return ends.map((pair) => ({ name: link.name, ground: link.ground, ends: pair, middle }));
  });
}

/** How far the guides on the ground pass the first fixed pivot, as lengths from it to them. */
function offsetsOf(scene, rails, ground, index) {
  const pivot = scene.joints.find(({ type, links }) => type !== "prismatic" && links.includes(ground));
  const from = pivot && place(scene, pivot.at, index);
  return rails.flatMap((one) => {
    const spot = place(scene, one.on, index) ?? place(scene, one.at, index);
    if (!from || !spot) return [];
    const [c, s] = [Math.cos(guide(scene, one, index)), Math.sin(guide(scene, one, index))];
    const across = (spot[1] - from[1]) * c - (spot[0] - from[0]) * s;
    return Math.abs(across) > 1e-9 ? { name: ground, ground: false, ends: [from, [from[0] - s * across, from[1] + c * across]] } : [];
  });
}

/** Whether a point of the ground only says where a guide is: that may be anywhere along it. */
const slides = (scene, key) => scene.joints.some(({ type, at, on }) => type === "prismatic" && [at, on].includes(key));

/** Spots that are not on one another. */
function apart(spots) {
  const far = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
  const size = Math.max(...spots.map((spot) => far(spot, spots[0])), 0);
  return spots.filter((spot, order) => !spots.slice(0, order).some((other) => far(spot, other) <= 1e-6 * size));
}

/** The dimensions as they are drawn; `words(x, y, text)` puts words where there is room, `spare(x, y, text, angle)` tells whether there is room at a place:
 * dimensions that have none are left out, those of the chosen link last. */
export function dimensionMarks(view, words, spare) {
  if (!state.layers.peek().dimensions || !view.scene || view.ideal) return [];
  const { scene, frame, posed } = view;
  const chosen = state.selection.peek()?.name;
  const rows = lengthsOf(scene, posed).sort((one, other) => Number(other.name === chosen) - Number(one.name === chosen));
  const all = scene.links.flatMap((link) => link.points.map((key) => place(scene, key, posed)).filter(Boolean)).map(frame.to);
  const middle = [0, 1].map((axis) => all.reduce((sum, spot) => sum + spot[axis], 0) / all.length);
  const ground = scene.links.find((link) => link.ground)?.name;
  const rails = scene.joints.filter(({ type, links }) => type === "prismatic" && links.includes(ground));
  return [
    ...[...rows, ...offsetsOf(scene, rails, ground, posed)].flatMap((row) => length(frame, row, row.middle ? frame.to(row.middle) : middle, spare)),
    ...rows.filter((row) => row.ground).flatMap(({ ends: [a, b] }) => angle(frame, a, Math.atan2(b[1] - a[1], b[0] - a[0]), words)),
    ...rails.flatMap((one) => {
      const spot = place(scene, one.at, posed) ?? place(scene, one.on, posed);
      return spot ? angle(frame, spot, guide(scene, one, posed), words) : [];
    }),
  ];
}

/** A line beside two points with its length, away from the middle of the mechanism. */
function length(frame, { name, ends, ground }, middle, spare) {
  const [[x, y], [a, b]] = ends.map(frame.to);
  const far = Math.hypot(a - x, b - y);
  if (far < SHORT) return [];
  const [ux, uy] = [(a - x) / far, (b - y) / far];
  const out = (x + a) / 2 - middle[0] ? (middle[0] - (x + a) / 2) * -uy + (middle[1] - (y + b) / 2) * ux : 1;
  const side = (out > 0 ? -1 : 1) * (ground ? -1 : 1); // of the ground on the other side, clear of links
  const [nx, ny] = [-uy * side, ux * side];
  const at = (px, py, by) => `${(px + nx * by).toFixed(1)},${(py + ny * by).toFixed(1)}`;
  const aside = ground ? ASIDE + 14 : ASIDE;
  const tick = (px, py) => `M${(px + nx * aside - (ux + nx) * TICK).toFixed(1)},${(py + ny * aside - (uy + ny) * TICK).toFixed(1)}l${(2 * (ux + nx) * TICK).toFixed(1)},${(2 * (uy + ny) * TICK).toFixed(1)}`;
  const d = `M${at(x, y, GAP)}L${at(x, y, aside + 4)}M${at(a, b, GAP)}L${at(a, b, aside + 4)}M${at(x, y, aside)}L${at(a, b, aside)}${tick(x, y)}${tick(a, b)}`;
  const turn = (Math.atan2(uy, ux) * 180) / Math.PI;
  const upright = turn >= 90 || turn < -90 ? turn + 180 : turn;
  const words = stated(Number(Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]).toPrecision(6)), "m");
  if (!spare((x + a) / 2 + nx * aside, (y + b) / 2 + ny * aside, words, Math.atan2(uy, ux))) return []; // it is told under Properties
  const spot = `translate(${at((x + a) / 2, (y + b) / 2, aside)}) rotate(${upright.toFixed(2)})`;
  return [
    svg("path", { class: "dimension-line", d }),
    svg("text", { class: "dimension-text", transform: spot, dy: "-0.4em", "data-of": name }, words),
  ];
}

/** The angle of what is fixed against the horizontal, from −90° to 90°; nothing where it is level. */
function angle(frame, spot, turn, put) {
  const level = Math.atan(Math.tan(turn));
  if (Math.abs(level) < LEVEL) return [];
  const [x, y] = frame.to(spot);
  const [ex, ey] = [x + ARC * Math.cos(level), y - ARC * Math.sin(level)];
  const d = `M${x.toFixed(1)},${y.toFixed(1)}h${ARC + 14}M${(x + ARC).toFixed(1)},${y.toFixed(1)}A${ARC},${ARC} 0 0 ${level > 0 ? 0 : 1} ${ex.toFixed(1)},${ey.toFixed(1)}`;
  const [tx, ty] = [x + (ARC + 6) * Math.cos(level / 2), y - (ARC + 6) * Math.sin(level / 2)];
  const words = `${Number(((level * 180) / Math.PI).toFixed(2))}°`.replace("-", "−");
  return [svg("path", { class: "dimension-line", d }), put(tx, ty + 4, words)];
}
