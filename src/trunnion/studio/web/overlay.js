// What lies over the mechanism on the sheet: motion of the chosen point, instant centres, friction circles, transmission
// angles, values at the arrows, and the outlines of variant A. Python works it out; here it is only drawn.

import { arrow } from "../web/arrow.js";
import { told as rounded } from "../web/built.js";
import { at, forceAt, magnitude, peak, place } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { quantity, roundBelow, short, stated } from "../web/format.js";
import { outline, standing } from "../web/plane.js";
import { KEY, perNewton } from "./drawing.js";
import { roundAbove } from "./geometry.js";
import { laid } from "./layers.js";
import { dimensionMarks } from "./measures.js";
import { pinsInHoles } from "./seats.js";
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
