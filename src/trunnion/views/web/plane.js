// The mechanism in the plane as SVG, in the report and in the studio: parts are built once and posed at every position.

import { arrow } from "./arrow.js";
import { hole, leaning, play, seatOf } from "./built.js";
import { at, forceAt, guide, hull, peak, place, quantile, usualPeak } from "./data.js";
import { set, svg } from "./dom.js";
import { short } from "./format.js";
import { loadsOf, poseLoad } from "./load.js";

const BEYOND = 26; // px that a guide is longer than the travel of its block's middle, at each end
const PISTON = 0.95; // length of a cylinder's rod, of the least distance of its eyes
const ASIDE = 0.01; // of that distance: how far the eyes of a cylinder may lie off its guide
const CROWD = 60; // names, of which those without room are left out until the drawing is larger
const LETTER = 8.4; // px, width of a letter of a name
const [ABOVE, BELOW] = [11, 4]; // px that a name reaches above and below its line

/** Where a name may stand beside its joint, [x, y] px to the middle of its first letter, in the order in which they are tried. */
const SIDES = {
  free: [[-11, -11], [11, -11], [-11, 20], [11, 20]],
  grounded: [[-19, 15], [19, 15], [-11, -11], [11, -11]], // clear of the bearing
  slides: [[26, -13], [-26, -13], [26, 24], [-26, 24]], // clear of the block
}; // prettier-ignore

/**
 * A mechanism at a position (3.4 is between two), in a frame; `spot(key)` is where a point stands in px, or null.
 * `more` is {perNewton: px a newton, force: the position whose forces are drawn, shown: (joint) => whether with its force,
 * named: whether with names, forward: the sense of the first drive, room: {width, height} px for words}.
 */
export function standing(scene, frame, index, more) {
  const spot = (key) => {
    const found = place(scene, key, index);
    return found && frame.to(found);
  };
  return { scene, frame, index, spot, spots: (keys) => keys.map(spot).filter(Boolean), ...more };
}

/** The parts of a scene by kind, {node, pose(now)} each, in the order in which they are drawn over one another. */
export function partsOf(scene, kinds) {
  const ground = scene.links.find((link) => link.ground)?.name;
  const moving = scene.links.filter((link) => !link.ground);
  const tint = (name) => `k${moving.findIndex((link) => link.name === name) % 6}`;
  const fixed = (one) => one.links.includes(ground);
  const slides = (one) => one.type === "prismatic";
  const cylinders = scene.joints.filter((one) => slides(one) && !fixed(one)).flatMap((one) => cylinder(scene, one, tint) ?? []);
  const driven = new Set(cylinders.map((one) => one.joint));
  const rods = new Set(cylinders.flatMap((one) => one.joint.links));
  const side = (one) => (slides(one) ? "slides" : fixed(one) ? "grounded" : "free");
  const free = scene.links.flatMap((link) => link.free.map((key) => ({ link, key })));
  return {
    supports: scene.joints.filter((one) => fixed(one) && !slides(one)).map((one) => support(one, ground)),
    guides: scene.joints.filter((one) => fixed(one) && slides(one)).map((one) => rail(one, ground)),
    bodies: moving.filter((link) => !rods.has(link.name)).map((link) => body(link, tint(link.name))),
    slots: scene.joints.filter((one) => slides(one) && !fixed(one) && !driven.has(one)).map((one) => slot(scene, one, tint(one.links[0]))),
    cylinders,
    gears: scene.gears.map(gear),
    points: free.map(({ link, key }) => dot(key, link.ground ? 3 : 3.5)),
    walls: scene.joints.filter((one) => slides(one) && play(scene, one.name)).map(walls),
    joints: [...scene.joints].sort((a, b) => Number(slides(b)) - Number(slides(a))).filter((one) => !driven.has(one)).map((one) => joint(scene, one)), // no block hides a pin
    springs: scene.springs.map(spring),
    drives: scene.drivers.flatMap((one) => drive(scene, one) ?? []),
    loads: loadsOf(scene).map(load),
    vectors: scene.joints.map((one) => vector(one, kinds.get(one.name) ?? "k0")),
    names: [
      ...scene.joints.map((one) => nameOf(one.name, [one.at, one.on], side(one))),
      ...free.filter(({ link }) => !link.ground).map(({ link, key }) => nameOf(key.slice(link.name.length + 1), [key], "free")),
    ],
  }; // prettier-ignore
}

/** Put all parts to a position, and the names beside what stands there. */
export function poseParts(parts, now) {
  for (const [kind, list] of Object.entries(parts)) if (kind !== "names") list.forEach((part) => part.pose(now));
  poseNames(parts, now);
}

/** A place in a drawing as the end of a path. */
function pair(/** @type {number[]} */ [x, y]) {
  return `${x.toFixed(1)},${y.toFixed(1)}`;
}

/** Move a part to a spot, turned by an angle of the plane, rad; hidden where there is none. */
export function moveTo(node, spot, angle = 0) {
  const turn = angle ? ` rotate(${((-angle * 180) / Math.PI).toFixed(2)})` : "";
  set(node, { transform: spot ? `translate(${pair(spot)})${turn}` : null, visibility: spot ? null : "hidden" });
}

/** The hull of some spots as a path. */
export function outline(spots) {
  const corners = hull(spots).map(pair);
  return corners.length ? `M${corners.join("L")}${corners.length > 2 ? "Z" : "h0"}` : "";
}

/** Where a point goes, series of its own positions: of a mechanism that is being changed they may be fewer. */
const trackOf = ({ tracks, points }, key) => (tracks ? tracks[key] : points[key]);
/** So many positions a track has; of one that stays 1. */
const lengthOf = (track) => (track ? Math.max(track.x.length, track.y.length) : 0);

/** The path of a point; `write` makes the text of a place in metres. */
export function trackPath(scene, key, write) {
  let path = "";
  let pen = "M";
  const points = { [key]: trackOf(scene, key) };
  const count = lengthOf(points[key]);
  for (let index = 0; index < count + (scene.abscissa.closed ? 1 : 0); index += 1) {
    const found = place({ points }, key, index % count);
    if (found) path += `${pen}${write(found)}`;
    pen = found ? "L" : "M";
  }
  return path;
}

/** The paths of moving points: coupler curves of named points, thin ones of joints. `nodes` are used again, in order. */
export function tracksOf(scene, write, nodes = []) {
  const keys = scene.links.filter((one) => !one.ground).flatMap((link) => link.points.map((key) => [key, link.free.includes(key)]));
  const moving = keys.filter(([key]) => lengthOf(trackOf(scene, key)) > 1);
  return moving.map(([key, free], order) => set(nodes[order] ?? svg("path"), { class: free ? "track free" : "track", d: trackPath(scene, key, write) }));
}

// ---- ground ---------------------------------------------------------------------------------------------------------

/** A line from -half to half with strokes on its far side, `below` px under the middle. */
function hatching(half, below) {
  let path = `M${-half},${below}H${half}`;
  for (let along = -half + 5; along <= half && half < 4000; along += 6.5) path += `M${along.toFixed(1)},${below}l-6,7`;
  return path;
}

/** The point of the ground at a joint before the other: a pin off the middle of its hole does not move the ground. */
function grounded(one, ground) {
  return one.at === `${ground}.${one.name}` ? [one.at, one.on] : [one.on, one.at];
}

function support(one, ground) {
  const node = svg("g", { class: "ground" }, svg("path", { class: "bearing", d: "M0,0l-11,19h22Z" }), svg("path", { class: "hatch", d: hatching(20, 19) }));
  const keys = grounded(one, ground);
  return { joint: one, node, pose: ({ spot }) => moveTo(node, spot(keys[0]) ?? spot(keys[1])) };
}

/** The guide of a slide on the ground, as long as its block travels; anew where the motion or the frame is another. */
function rail(one, ground) {
  const node = svg("path", { class: "hatch" });
  let [known, seen] = [null, null];
  const pose = ({ scene, frame }) => {
    if (known === scene && seen === frame) return;
    [known, seen] = [scene, frame];
    const angle = guide(scene, one, 0);
    const [ux, uy] = [Math.cos(angle), Math.sin(angle)];
    const base = place(scene, grounded(one, ground)[0], 0);
    let [low, high, across] = [Infinity, -Infinity, 0];
    const points = { [one.at]: trackOf(scene, one.at) ?? scene.points[one.at] };
    for (let index = 0; index < lengthOf(points[one.at]); index += 1) {
      const found = place({ points }, one.at, index);
      if (!found) continue;
      const along = found[0] * ux + found[1] * uy;
      [low, high, across] = [Math.min(low, along), Math.max(high, along), found[1] * ux - found[0] * uy];
    }
    if (base) across = base[1] * ux - base[0] * uy;
    if (!(low <= high)) return set(node, { d: "" });
    const middle = (low + high) / 2;
    const half = ((high - low) / 2) * frame.scale + BEYOND;
    set(node, { d: hatching(half, 11 + play(scene, one.name) * frame.scale) });
    moveTo(node, frame.to([middle * ux - across * uy, middle * uy + across * ux]), angle);
  };
  return { joint: one, node: svg("g", { class: "ground" }, node), pose };
}

// ---- links ----------------------------------------------------------------------------------------------------------

/** An outline that is drawn wide, then less wide in its tint. */
function plate(kind) {
  return ["edge", "underlay", "plate"].map((name) => svg("path", { class: name === "underlay" ? name : `${name} ${kind}` }));
}

function body(link, kind) {
  const paths = plate(kind);
  const pose = ({ spots }) => {
    const path = outline(spots(link.points));
    paths.forEach((part) => set(part, { d: path }));
  };
  return { link, node: svg("g", { class: "body", "data-kind": "links", "data-name": link.name }, svg("title", {}, link.name), ...paths), pose };
}

/** The guide of a slide between moving links: a bar of the first with a slit in it for the block. */
function slot(scene, one, kind) {
  const [bar, slit] = [plate(kind), svg("path", { class: "slit" })];
  const reach = travel(scene, one); // from the first link's point along the guide, m
  const pose = ({ scene: present, frame, spot, index }) => {
    const [start, angle] = [spot(one.on), guide(present, one, index)];
    const path = (low, high) => (start && low <= high ? `M${pair(along(start, angle, low))}L${pair(along(start, angle, high))}` : "");
    const [low, high] = [reach[0] * frame.scale - BEYOND, reach[1] * frame.scale + BEYOND];
    bar.forEach((part) => set(part, { d: path(Math.min(low, 0), Math.max(high, 0)) })); // as far as the link's own point
    set(slit, { d: path(low, high) });
  };
  return { joint: one, node: svg("g", { class: "slot", "data-kind": "links", "data-name": one.links[0] }, ...bar, slit), pose };
}

/** So many px from a spot in a direction of the plane. */
function along(/** @type {number[]} */ [x, y], angle, far) {
  return [x + far * Math.cos(angle), y - far * Math.sin(angle)];
}

/** Least and greatest slide over all positions, m. */
function travel(scene, one) {
  let [low, high] = [Infinity, -Infinity];
  for (let index = 0; index < scene.count; index += 1) {
    const [on, end] = [place(scene, one.on, index), place(scene, one.at, index)];
    if (!on || !end) continue;
    const angle = guide(scene, one, index);
    const slide = (end[0] - on[0]) * Math.cos(angle) + (end[1] - on[1]) * Math.sin(angle);
    [low, high] = [Math.min(low, slide), Math.max(high, slide)];
  }
  return [low, high];
}

/**
 * A driven slide between two links that are pinned at their other ends, as a barrel with its rod; null for another: if no
 * driver moves it, a link has more joints, the eyes lie off the guide, or the stroke is longer than a barrel could be.
 * The rule is that of trunnion/views/sketch.py.
 */
function cylinder(scene, one, tint) {
  const eyes = one.links.map((name) => scene.links.find((link) => link.name === name)?.points.filter((key) => key !== `${name}.${one.name}`) ?? []);
  const pinned = eyes.every((keys, order) => keys.length === 1 && scene.joints.some(({ name }) => keys[0] === `${one.links[order]}.${name}`));
  if (!pinned || !scene.drivers.some(({ name }) => name === one.name)) return null;
  let [low, high, aside] = [Infinity, 0, 0];
  for (let index = 0; index < scene.count; index += 1) {
    const [start, end] = eyes.map(([key]) => place(scene, key, index));
    if (!start || !end) continue;
    const [dx, dy, angle] = [end[0] - start[0], end[1] - start[1], guide(scene, one, index)];
    [low, high] = [Math.min(low, Math.hypot(dx, dy)), Math.max(high, Math.hypot(dx, dy))];
    aside = Math.max(aside, Math.abs(dy * Math.cos(angle) - dx * Math.sin(angle)));
  }
  const rod = PISTON * low;
  const barrel = high - rod + (1 - PISTON) * low;
  if (!(barrel < low && aside < ASIDE * low)) return null;
  const shapes = [plate(tint(one.links[1])), plate(tint(one.links[0]))];
  const parts = shapes.map((paths, order) => svg("g", { class: order ? "barrel" : "rod", "data-kind": "links", "data-name": one.links[1 - order] }, svg("title", {}, one.links[1 - order]), ...paths));
  const pose = ({ frame, spot }) => {
    const [start, end] = [spot(eyes[0][0]), spot(eyes[1][0])];
    const far = start && end ? Math.hypot(end[0] - start[0], end[1] - start[1]) : 0;
    const piece = (from, to, length) => (far ? `M${pair(from)}l${pair([0, 1].map((axis) => ((to[axis] - from[axis]) / far) * length * frame.scale))}` : "");
    shapes[0].forEach((path) => set(path, { d: piece(end, start, rod) }));
    shapes[1].forEach((path) => set(path, { d: piece(start, end, barrel) }));
  };
  return { joint: one, parts, node: svg("g", { class: "cylinder" }, ...parts), pose };
}

// ---- joints and what acts at them -----------------------------------------------------------------------------------

/** The symbol of a joint; of one with play the hole and, in it, the pin; a block as long as its guide holds it. */
function joint(scene, one) {
  const slides = one.type === "prismatic";
  const length = seatOf(scene.built, one.name)?.length; // the block is seen through then
  const shape = slides ? svg("rect", { y: -10, height: 20, rx: 1.5, class: length ? "clear" : null }) : svg("circle");
  const node = svg("g", { class: "joint", "data-name": one.name }, svg("title", {}, one.name), shape);
  const pin = !slides && play(scene, one.name) ? svg("circle", { class: "pin", r: 5 }) : null;
  const pose = ({ scene: present, frame, spot, index }) => {
    if (slides) {
      const wide = length ? Math.max(length * frame.scale, 8) : 34;
      set(shape, { x: (-wide / 2).toFixed(1), width: wide.toFixed(1) });
    } else set(shape, { r: (5 + play(present, one.name) * frame.scale).toFixed(1) });
    const angle = slides ? guide(present, one, index) + leaning(present, one, index) : 0;
    const bored = slides ? null : hole(present, one, index);
    moveTo(node, (bored && frame.to(bored)) ?? spot(one.at) ?? spot(one.on), angle);
    if (pin) moveTo(pin, spot(one.on));
  };
  return { joint: one, node: pin ? svg("g", {}, node, svg("g", { class: "joint" }, pin)) : node, pose };
}

/** Both walls of a guide with play, as far apart as the block is high and the play wide. */
function walls(one) {
  const node = svg("path", { class: "rail" });
  const pose = ({ scene, frame, spot, index }) => {
    const [on, end] = [spot(one.on), spot(one.at)];
    if (!on || !end) return set(node, { d: "" });
    const angle = guide(scene, one, index);
    const slide = (end[0] - on[0]) * Math.cos(angle) - (end[1] - on[1]) * Math.sin(angle);
    const half = Math.max(((seatOf(scene.built, one.name)?.length ?? 0) / 2) * frame.scale, 17) + 14;
    const gap = 10 + play(scene, one.name) * frame.scale;
    const wall = (side) => [slide - half, slide + half].map((far) => pair(along(along(on, angle, far), angle + Math.PI / 2, side))).join("L");
    return set(node, { d: `M${wall(gap)}M${wall(-gap)}` });
  };
  return { joint: one, node, pose };
}

function gear({ name, at: key, radius }) {
  const paths = [svg("circle", { class: "pitch-circle" })];
  const node = svg("g", { "data-kind": "gears", "data-name": name }, svg("title", {}, name), ...paths);
  const pose = ({ frame, spot }) => {
    moveTo(node, spot(key));
    paths.forEach((one) => set(one, { r: radius * frame.scale }));
  };
  return { paths, node, pose };
}

function dot(key, radius) {
  const node = svg("g", { class: "point" }, svg("circle", { r: radius }));
  return { key, node, pose: ({ spot }) => moveTo(node, spot(key)) };
}

/** A spring; dashed where it acts one way and does not act. */
function spring({ name, ends, pull = [] }) {
  const paths = [svg("path", { class: "spring" })];
  const node = svg("g", { "data-kind": "springs", "data-name": name }, svg("title", {}, name), ...paths);
  const pose = ({ scene, spots, index }) => {
    const present = scene.springs.find((one) => one.name === name)?.pull ?? pull;
    const d = coil(spots(ends));
    paths.forEach((path) => set(path, { d, "stroke-dasharray": at(present, index) === 0 ? "2 3" : "none" }));
  };
  return { paths, node, pose };
}

/** An arc around a turning drive in the sense in which it turns; along its way, for a sliding one an arrow. */
function drive(scene, driver) {
  const one = scene.joints.find(({ name }) => name === driver.name);
  if (!one) return null;
  const node = svg("path", { class: "drive" });
  const first = scene.drivers[0] === driver;
  const pose = ({ scene: present, spot, index, forward }) => {
    const found = spot(one.at);
    const { values, period } = present.abscissa;
    const sense = (first && Math.sign(period || values[values.length - 1] - values[0])) || forward;
    if (!found || !sense) return set(node, { d: "" });
    const [x, y] = found;
    if (driver.type === "prismatic") {
      const angle = guide(present, one, index);
      const [left, low] = along(found, angle + Math.PI / 2, 30);
      return set(node, { d: arrow(left, low, 34 * sense * Math.cos(angle), -34 * sense * Math.sin(angle)) });
    }
    const end = sense > 0 ? -1 : 1; // counter-clockwise ends on the left
    const tip = [x + end * 19, y - 15];
    const head = `m${-end * 1.2},-8.2L${tip}l${-end * 8.2},-1.2`;
    return set(node, { d: `M${x - end * 19},${y - 15}A24.2,24.2 0 0 ${sense > 0 ? 0 : 1} ${tip}${head}` });
  };
  return { driver, joint: one, node, pose };
}

/** The force on the second link of a joint. */
function vector(one, kind) {
  const node = svg("path", { class: `reaction ${kind}` });
  const pose = ({ scene, spot, force: index, perNewton, shown }) => {
    const [found, force] = [spot(one.at), forceAt(scene, one, index)];
    set(node, { d: found && force && shown(one.name) ? arrow(...found, force[0] * perNewton, -force[1] * perNewton) : "" });
  };
  return { joint: one, node, pose };
}

/** `box`: where its value stands. */
function load(one) {
  const part = { ...one, box: null, pose: (now) => (part.box = poseLoad(one, now)) };
  return part;
}

/** The forces on joints and the loads that are drawn: [{keys: of where they act, at(index): [x, y] N or null}]. */
export function forcesOf(scene) {
  const loads = loadsOf(scene).filter((one) => one.force);
  return [
    ...scene.joints.map((one) => ({ keys: [one.at], at: (index) => forceAt(scene, one, index) })),
    ...loads.map((one) => ({ keys: one.keys, at: (index) => one.force(scene, index) })),
  ];
}

/** Of forces over all positions {usual: N that shall be well seen, most: N that shall be in the picture, beyond: whether some are not}. */
export function sizesOf(scene, forces) {
  const sizes = forces.map(({ at: force }) => Array.from({ length: scene.count }, (_, index) => (force(index) ? Math.hypot(...force(index)) : null)));
  const most = usualPeak(scene, ...sizes);
  return { usual: Math.max(Math.min(quantile(sizes.flat(), 0.9), most), most / 2), most, beyond: most < peak(...sizes) };
}

// ---- names ----------------------------------------------------------------------------------------------------------

function nameOf(name, keys, side) {
  const words = short(name);
  return { name: words, keys, side, node: svg("text", { class: "name" }, words), box: null };
}

/** Names stand clear of the loads' values and of one another; those of one spot stand side by side. */
function poseNames({ names, loads }, { spot, named }) {
  const there = new Map();
  const taken = loads.flatMap(({ box }) => box ?? []);
  for (const one of names) {
    one.box = null;
    const found = named ? one.keys.map(spot).find(Boolean) : null;
    const first = found && there.get(`${one.side} ${found.map(Math.round)}`);
    if (first && !first.words.includes(one.name)) first.words.push(one.name);
    if (found && !first) there.set(`${one.side} ${found.map(Math.round)}`, { one, found, words: [one.name] });
    if (!found || first) moveTo(one.node, null);
  }
  for (const { one, found, words } of there.values()) {
    const text = words.join(", ");
    const places = SIDES[one.side].map((by) => boxOf(found, by, text.length * LETTER));
    const box = places.find((place) => !taken.some((other) => meet(place, other))) ?? (there.size > CROWD ? null : places[0]);
    if (!box) {
      moveTo(one.node, null);
      continue;
    }
    taken.push((one.box = box));
    if (one.node.textContent !== text) one.node.textContent = text;
    moveTo(one.node, [(box.left + box.right) / 2, box.y]);
  }
}

/** Where words stand whose first letter's middle is so far from a spot; they grow away from it. */
function boxOf([x, y], [dx, dy], wide) {
  const middle = x + dx + Math.sign(dx) * ((wide - LETTER) / 2);
  return { left: middle - wide / 2, right: middle + wide / 2, top: y + dy - ABOVE, bottom: y + dy + BELOW, y: y + dy };
}

function meet(one, other) {
  return one.left < other.right && one.right > other.left && one.top < other.bottom && one.bottom > other.top;
}

// ---- springs -------------------------------------------------------------------------------------------------------

const TURNS = 8;
const WIDTH = 7; // px, to each side
const END = 0.18; // share of the length that is straight at each end

/** The path between two places; none if an end has no place. */
function coil(ends) {
  if (ends.length < 2) return "";
  const [[x1, y1], [x2, y2]] = ends;
  const length = Math.hypot(x2 - x1, y2 - y1) || 1;
  const across = [(-(y2 - y1) * WIDTH) / length, ((x2 - x1) * WIDTH) / length];
  const corners = [[END, 0]];
  for (let turn = 0; turn < 2 * TURNS; turn += 1)
    corners.push([END + ((1 - 2 * END) * (turn + 0.5)) / (2 * TURNS), turn % 2 ? -1 : 1]);
  corners.push([1 - END, 0], [1, 0]);
  const spot = ([along, side]) =>
    `${(x1 + along * (x2 - x1) + side * across[0]).toFixed(1)},${(y1 + along * (y2 - y1) + side * across[1]).toFixed(1)}`;
  return `M${x1.toFixed(1)},${y1.toFixed(1)}L${corners.map(spot).join("L")}`;
}
