// What lies over the mechanism on the sheet: motion of the chosen point, instant centres, friction circles, transmission
// angles, values at the arrows, and the outlines of variant A. Python works it out; here it is only drawn.

import { arrow } from "../web/arrow.js";
import { hole, jumpsAt, leaning, told as rounded } from "../web/built.js";
import { angleAt, at, forceAt, guide, hull, magnitude, peak, place } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { quantity, roundBelow, short, stated } from "../web/format.js";
import { outline, standing } from "../web/plane.js";
import { KEY, perNewton } from "./drawing.js";
import { roundAbove } from "./geometry.js";
import { laid } from "./layers.js";
import { cornered, sheet, shown } from "./sheet.js";
import * as state from "./state.js";
import { compared } from "./variants.js";

const CIRCLE = 12; // px: smaller friction circles are drawn enlarged
const ROOM = 26; // px between the frame and what points out of it
const LETTER = 7.3; // px, its width in what is written
const LINE = 15; // px, its height
const SMALL = 6.2; // px, a letter of a dimension
const RING = 14; // px, radius of the ring of a joint that locks
const NOTHING = 1e-9; // of the largest force: less is rounding
const VECTORS = [["velocity", "v", "m/s"], ["acceleration", "a", "m/s²"]];

/** Where words stand already, [{left, right, y}] px. */
let taken = [];
let dimensions = []; // the rows of those that are taken by dimensions
let room = 0; // px, where words end at the right

/** Make room for it: variants under the mechanism, all else over it. */
export function addOverlay({ root, layers }) {
  layers.variants = svg("g", { class: "layer variants-of-sheet" });
  layers.overlay = svg("g", { class: "layer overlay" });
  layers.masses = svg("g", { class: "layer masses" });
  root.insertBefore(layers.variants, layers.ground);
  root.insertBefore(layers.masses, layers.parts);
  root.insertBefore(layers.overlay, layers.names);
}

/** Draw it for the position that is shown: variants also while a joint is dragged, the rest once there is an answer. */
export function poseOverlay(view) {
  const { layers, scene } = view;
  const known = state.solved.peek() && !state.live.peek() && !shown.peek()?.sketched;
  const wanted = state.layers.peek();
  const found = known && laid.peek()?.scene === (scene.of ?? scene) ? laid.peek() : {};
  const corner = Boolean(view.ideal && cornered.peek()); // of which nothing but its places is told
  const point = corner ? null : found.point;
  const told = view.ideal ? { point, seats: corner ? null : found.seats } : found; // the rest is where it is
  const key = []; // lines of the key, from below
  room = view.frame.width - 56; // beside the buttons that zoom
  dimensions = [];
  taken = [...view.parts.names, ...view.parts.loads].flatMap(({ box }) => box ?? []);
  if (sheet.beside().length) key.push(keyed(view, 22, "other assemblies", (x, y) => svg("g", { class: "ghost" }, svg("path", { d: `M${x},${y}h22` }))));
  layers.variants.replaceChildren(...(view.ideal ? nominal(view, wanted, key) : wanted.variant ? variants(view, key) : []));
  const seats = wanted.seats && view.ideal ? (told.seats ?? []) : [];
  for (const { joint, node } of view.parts.vectors) set(node, { visibility: corner || seats.some((one) => one.joint === joint.name) ? "hidden" : null }); // drawn where it touches
  layers.overlay.replaceChildren(
    ...dimensionMarks(view, words, spare),
    ...(told.circles ? circles(view, told.circles, key) : []),
    ...(told.transmission ? told.transmission.flatMap((one) => transmission(view, one)) : []),
    ...(told.centres ? centres(view, told.centres, wanted) : []),
    ...(known && !corner && wanted.reactions && wanted.values ? values(view) : []),
    ...pinsInHoles(view, seats, wanted, words),
    ...(told.point ? motion(view, told.point, wanted, key) : []),
    ...locking(view),
    ...key.map((draw, order) => draw(view.frame.height - 16 - 20 * (order + 1))),
  );
}

/** Words that take no room of others: they step down until they are free, and aside where the window ends. */
function words(x, y, text, kind = "") {
  const wide = LETTER * text.length;
  const left = Math.max(Math.min(kind === "to-left" ? x - wide : x, room - wide), 0);
  const meets = (one) => left < one.right && left + wide > one.left && Math.abs(one.y - y) < LINE;
  while (taken.some(meets)) y += LINE;
  taken.push({ left, right: left + wide, y });
  return svg("text", { class: `laid ${kind}`, x: (kind === "to-left" ? left + wide : left).toFixed(1), y: y.toFixed(1) }, text);
}

/** Whether there is room among the dimensions for words about a place, turned by an angle; then it is theirs. */
function spare(x, y, text, turn) {
  const half = 0.5 * SMALL * text.length;
  const [c, s] = [Math.abs(Math.cos(turn)), Math.sin(turn) * Math.sign(Math.cos(turn) || 1)];
  const steps = Math.ceil((half * Math.abs(s)) / (LINE / 2)); // a row for each line of height
  const wide = steps ? Math.max((half * c) / (steps + 1), SMALL / 2) : half;
  const rows = Array.from({ length: 2 * steps + 1 }, (_, order) => {
    const share = steps ? order / steps - 1 : 0;
    const middle = x + share * Math.max(half * c - wide, 0);
    return { left: middle - wide, right: middle + wide, y: y + share * half * s + 4 };
  });
  const free = !rows.some((row) => dimensions.some((one) => row.left < one.right && row.right > one.left && Math.abs(one.y - row.y) < 0.8 * LINE));
  if (free) [taken, dimensions].forEach((list) => list.push(...rows));
  return free;
}

/** Words beyond the tip of an arrow from a spot. */
function beyond([x, y], [dx, dy], text) {
  const size = Math.hypot(dx, dy) || 1;
  return words(x + dx + (9 * dx) / size, y + dy + (13 * dy) / size + 4, text, dx < 0 ? "to-left" : "");
}

/** A line of the key, at the right edge of the sheet. */
function keyed({ frame }, wide, text, drawn) {
  return (y) => {
    const x = frame.width - wide - KEY;
    return svg("g", {}, drawn(x, y), svg("text", { class: "of-key", x: x + wide + 8, y, dy: "0.32em" }, text));
  };
}

// ---- the chosen point -----------------------------------------------------------------------------------------------

function motion(view, point, wanted, key) {
  const { frame, exact: index, scene } = view;
  const found = place(scene, point.key, index);
  if (!found) return [];
  const [x, y] = frame.to(found);
  return VECTORS.filter(([name]) => wanted[name]).flatMap(([name, sign, unit]) => {
    const parts = point[name];
    const sizes = magnitude(parts, scene.count);
    const scale = (0.2 * Math.min(frame.width, frame.height)) / peak(sizes);
    if (!Number.isFinite(scale)) return [];
    const one = roundBelow(110 / scale);
    key.push(keyed(view, one * scale, `${name} ${stated(one, unit)}`, (left, low) => svg("path", { class: `motion ${name}`, d: arrow(left, low, one * scale, 0) })));
    const [dx, dy] = [at(parts.x, index), at(parts.y, index)];
    if (dx === null || dy === null) return [];
    const vector = svg("path", { class: `motion ${name}`, d: arrow(x, y, dx * scale, -dy * scale) });
    return [vector, beyond([x, y], [dx * scale, -dy * scale], `${sign} = ${quantity(at(sizes, index), unit, peak(sizes))}`)];
  });
}

// ---- instant centres ------------------------------------------------------------------------------------------------

function centres(view, list, wanted) {
  const { frame, index } = view;
  return list
    .filter((one) => (one.ground ? wanted.centres : wanted.relative))
    .flatMap(({ pair, joint, x, y, far, ground }) => {
      const name = `${pair[1]} / ${pair[0]}`;
      const kind = ground ? "centre absolute" : "centre";
      const [a, b] = [at(x, index), at(y, index)];
      const title = svg("title", {}, `instant centre of ${pair[1]} against ${pair[0]}`);
      if (a !== null && b !== null) {
        const spot = frame.to([a, b]);
        if (!inside(frame, spot)) return edge(frame, spot, kind, `${name}, ${stated(Math.hypot(...less(frame, spot)) / frame.scale, "m")} from the middle of the sheet`);
        const mark = svg("path", { class: kind, d: `M${spot[0].toFixed(1)},${spot[1].toFixed(1)}m-6,0l6,-6l6,6l-6,6Z` }, title);
        return joint ? [mark] : [mark, words(spot[0] + 10, spot[1] + 16, name)];
      }
      const [ux, uy] = far ? [at(far.x, index), at(far.y, index)] : [null, null];
      if (ux === null || uy === null) return [];
      const long = 4 * (frame.width + frame.height);
      return edge(frame, [frame.width / 2 + long * ux, frame.height / 2 - long * uy], kind, `${name}, at infinity`);
    });
}

function inside({ width, height }, [x, y]) {
  return x >= 0 && x <= width && y >= 0 && y <= height;
}

/** From the middle of the window to a spot, px. */
function less({ width, height }, [x, y]) {
  return [x - width / 2, y - height / 2];
}

/** A mark at the edge of the window that points to a spot outside it. */
function edge(frame, spot, kind, text) {
  const [dx, dy] = less(frame, spot);
  const reach = Math.min((frame.width / 2 - ROOM) / Math.abs(dx), (frame.height / 2 - 2 * ROOM) / Math.abs(dy));
  const [x, y] = [frame.width / 2 + dx * reach, frame.height / 2 + dy * reach];
  const size = Math.hypot(dx, dy);
  const right = x > frame.width / 2;
  const mark = svg("path", { class: kind, d: arrow(x - (14 * dx) / size, y - (14 * dy) / size, (14 * dx) / size, (14 * dy) / size) });
  return [mark, words(x + (right ? -20 : 20), y + 4, text, right ? "to-left" : "")];
}

// ---- friction circles -----------------------------------------------------------------------------------------------

function circles(view, list, key) {
  const { frame, scene, exact: index } = view;
  const most = peak(...list.map(({ radius }) => radius)) * frame.scale;
  if (!(most > 0)) return [];
  const times = most >= CIRCLE ? 1 : roundAbove(CIRCLE / most);
  const told = times > 1 ? `friction circles × ${times}` : "friction circles";
  key.push(keyed(view, 22, told, (x, y) => svg("circle", { class: "friction-circle", cx: x + 11, cy: y, r: 6 })));
  return list.flatMap(({ joint: name, radius, offset }) => {
    const joint = scene.joints.find((one) => one.name === name);
    const found = joint && place(scene, joint.at, index);
    const size = at(radius, index);
    if (!found || size === null) return [];
    const [x, y] = frame.to(found);
    const r = size * frame.scale * times;
    const circle = svg("circle", { class: "friction-circle", cx: x.toFixed(1), cy: y.toFixed(1), r: r.toFixed(1) });
    const told = words(x + 12 + r * 0.7, y + 18 + r * 0.4, `${name}: r = ${quantity(size, "m")}`);
    const arm = at(offset, index);
    const [fx, fy] = [at(joint.reaction.x, index), at(joint.reaction.y, index)];
    const force = Math.hypot(fx, fy);
    if (arm === null || !(force > 0)) return [circle, told];
    // to the right of the force, seen along it; y points down on the screen
    const shift = (arm * frame.scale * times) / force;
    const [tx, ty] = [x + shift * fy, y + shift * fx];
    const [ux, uy] = [(64 * fx) / force, (-64 * fy) / force];
    const line = svg("path", { class: "line-of-action", d: `M${tx - ux},${ty - uy}L${tx + ux},${ty + uy}` });
    return [line, circle, told];
  });
}

// ---- locking ----------------------------------------------------------------------------------------------------------

/** Joints that lock at the position that is shown, ringed, and the multiple of their friction at which they do. */
function locking({ frame, scene, posed, drawn }) {
  const live = state.live.peek();
  const locks = (live ?? (state.solved.peek() ? state.answer.peek() : null))?.locks ?? {};
  return Object.entries(locks).flatMap(([name, multiple]) => {
    const most = live ? multiple : multiple[posed];
    const found = place(scene, scene.joints.find((one) => one.name === name)?.at, drawn);
    if (!found || most === null || most === undefined) return [];
    const [x, y] = frame.to(found);
    const told = words(x + RING + 6, y - RING - 2, `${name} locks: it runs up to ${most.toPrecision(2)} times its friction`, "of-lock");
    return [svg("circle", { class: "lock-ring", cx: x.toFixed(1), cy: y.toFixed(1), r: RING }), told];
  });
}

// ---- transmission angles --------------------------------------------------------------------------------------------

/** The transmission angle of a dyad, at its middle joint. */
function transmission({ frame, scene, exact: index }, { joint: name, angle }) {
  const found = place(scene, scene.joints.find((one) => one.name === name)?.at, index);
  const size = at(angle, index);
  if (!found || size === null) return [];
  const [x, y] = frame.to(found);
  return words(x + 12, y - 22, `transmission angle ${((size * 180) / Math.PI).toFixed(1)}°`);
}

// ---- values of the reactions ----------------------------------------------------------------------------------------

function values(view) {
  const { scene, frame, exact: index } = view;
  const scale = perNewton(view);
  const sizes = scene.joints.map((one) => magnitude(one.reaction, scene.count));
  const least = NOTHING * peak(...sizes);
  return scene.joints.flatMap((joint) => {
    const force = forceAt(scene, joint, index);
    const found = place(scene, joint.at, index);
    if (!found || !force || !(Math.hypot(...force) > least)) return [];
    const [dx, dy] = [force[0] * scale, -force[1] * scale];
    return [beyond(frame.to(found), [dx, dy], `${joint.name} on ${short(joint.links[1])} ${quantity(Math.hypot(...force), "N")}`)];
  });
}

// ---- without errors --------------------------------------------------------------------------------------------------

/** The mechanism without errors behind the one that has them, and how much larger they are drawn. */
function nominal(view, wanted, key) {
  const { frame, drawn: index, ideal, scene } = view;
  const line = (x, y) => svg("path", { class: "ideal", d: `M${x},${y}h22` });
  if (wanted.nominal) key.push(keyed(view, 22, cornered.peek() ? "nominal" : "without errors", line));
  key.push(keyed(view, 22, `errors × ${rounded(scene.factor)}`, () => null));
  if (!wanted.nominal) return [];
  const { spots } = standing(ideal, frame, index, {});
  return ideal.links.filter((link) => !link.ground).map((link) => svg("path", { class: "ideal", d: outline(spots(link.points)) }));
}

// ---- variant A ------------------------------------------------------------------------------------------------------

function variants(view, key) {
  const { frame, exact: index, scene } = view;
  const other = compared.peek().find((one) => one.ghost && one.scene?.count === scene.count);
  if (!other) return [];
  const line = (x, y) => svg("path", { class: "outline-of-variant", d: `M${x},${y}h22` });
  key.push(keyed(view, 22, other.name, line));
  return other.scene.links
    .filter((link) => !link.ground)
    .map((link) => {
      const spots = standing(other.scene, frame, index, {}).spots(link.points);
      return svg("path", { class: "outline-of-variant", d: outline(spots) });
    });
}

// ---- pins in their holes -------------------------------------------------------------------------------------------

const PIN = 5; // px, radius of a pin as it is drawn
const BLOCK = 10; // px, half the height of a block
const NORMAL = 16; // px beyond the contact

/** What is drawn of the seats of the joints that are loose, at the present position. */
function pinsInHoles(view, seats, wanted, words) {
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

// ---- dimensions ----------------------------------------------------------------------------------------------------

const ASIDE = 24; // px between a link and its dimension line
const GAP = 9; // px between a point and its extension line
const TICK = 5; // px
const ARC = 44; // px, radius of the arc of an angle
const SHORT = 30; // px: shorter dimensions have no room for their words
const LEVEL = 1e-6; // rad: less is none

/** What is dimensioned at the shown position: [{name, ends: [[x, y], [x, y]]}] m, of each link and of the ground. */
function lengthsOf(scene, index) {
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
function dimensionMarks(view, words, spare) {
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
