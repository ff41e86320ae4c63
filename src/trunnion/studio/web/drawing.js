// The mechanism in the window as SVG: parts are built once for a structure and moved for every position.

import { arrow } from "../web/arrow.js";
import { forceAt, guide, hull, magnitude, place, quantile, solved, usualPeak } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { roundBelow, short, stated } from "../web/format.js";
import { loadsOf, poseLoad } from "../web/load.js";
import { poseSlot, slotsOf } from "../web/slot.js";
import { coil } from "../web/spring.js";
import { gridStep, posedAt } from "./geometry.js";

const MANY = 2000; // parts above which each kind is one plain path
export const KEY = 168; // px, room for the words of the key at the right edge
const LEGEND = 30; // px at the foot, where scale and key stand
export const TARGET = 12; // px, radius of what a pointer may hit

/** The drawing of a scene in an SVG element; `draw(scene)` builds, `pose(…)` moves, `fit` and `zoom` change the frame. */
export function drawing(root) {
  const layers = Object.fromEntries(
    ["grid", "tracks", "ghosts", "ground", "bodies", "parts", "vectors", "names", "handles", "locks", "tools", "key"].map((name) => [
      name,
      svg("g", { class: `layer ${name}` }),
    ]),
  );
  root.append(...Object.values(layers));
  return { root, layers, scene: null, index: 0, share: 0, parts: null, kinds: new Map(), factor: 1, shown: {}, frame: frameOf(800, 600, 2000, 0, 0) };
}

/** A frame: width and height px, px a metre, and where the origin lies. */
export function frameOf(width, height, scale, left, foot) {
  return {
    width,
    height,
    scale,
    left,
    foot,
    to: ([x, y]) => [left + scale * x, foot - scale * y],
    from: ([x, y]) => [(x - left) / scale, (foot - y) / scale],
  };
}

/** The frame that shows a box {x, y, width, height} in m with room around it. */
export function fitted(width, height, box) {
  const margin = Math.min(90, 0.14 * Math.min(width, height));
  const one = box ?? { x: -0.15, y: -0.1, width: 0.3, height: 0.2 };
  const across = Math.max(one.width, 0.02 * one.height, 1e-6);
  const up = Math.max(one.height, 0.02 * one.width, 1e-6);
  const scale = Math.min((width - 2 * margin) / across, (height - 2 * margin - 30) / up);
  const left = width / 2 - scale * (one.x + one.width / 2);
  const foot = (height - 30) / 2 + scale * (one.y + one.height / 2);
  return frameOf(width, height, scale, left, foot);
}

/** Show another part of the plane. */
export function reframe(view, frame) {
  view.frame = frame;
  set(view.root, { viewBox: `0 0 ${frame.width} ${frame.height}` });
  drawGrid(view);
  set(view.layers.tracks, { transform: `matrix(${frame.scale},0,0,${-frame.scale},${frame.left},${frame.foot})` });
  if (view.scene) {
    poseGuides(view);
    drawKey(view);
    pose(view, view.scene, view.index, view.share);
  }
}

function drawGrid({ frame, layers, shown }) {
  if (shown.grid === false) return layers.grid.replaceChildren();
  const step = gridStep(frame.scale);
  const [x0, y0] = frame.from([0, frame.height]);
  const [x1, y1] = frame.from([frame.width, 0]);
  const paths = { minor: "", major: "" };
  const lines = (low, high, line) => {
    for (let count = Math.ceil(low / step); count * step <= high; count += 1) {
      if (count === 0) continue;
      paths[count % 10 === 0 ? "major" : "minor"] += line(count * step);
    }
  };
  lines(x0, x1, (x) => `M${frame.to([x, 0])[0].toFixed(1)},0V${frame.height}`);
  lines(y0, y1, (y) => `M0,${frame.to([0, y])[1].toFixed(1)}H${frame.width}`);
  const [x, y] = frame.to([0, 0]).map((one) => one.toFixed(1));
  layers.grid.replaceChildren(
    svg("path", { class: "minor", d: paths.minor }),
    svg("path", { class: "major", d: paths.major }),
    svg("path", { class: "origin", d: `M${x},0V${frame.height}M0,${y}H${frame.width}` }),
  );
}

/** Build the parts of a scene. `kinds`: class of the colour of each joint. */
export function build(view, scene, kinds) {
  Object.assign(view, { scene, kinds, index: Math.min(view.index, scene.count - 1) });
  const simple = scene.links.length > MANY || scene.joints.length > MANY;
  view.parts = simple ? simpleParts() : allParts(scene, view);
  const { layers, parts } = view;
  const nodes = (list) => list.map((one) => one.node);
  layers.ground.replaceChildren(...nodes(parts.supports), ...nodes(parts.guides));
  layers.bodies.replaceChildren(...nodes(parts.bodies), ...nodes(parts.slots));
  layers.parts.replaceChildren(...nodes(parts.gears), ...nodes(parts.points), ...nodes(parts.joints), ...nodes(parts.springs), ...nodes(parts.drives), ...nodes(parts.loads), ...(parts.plain ?? []));
  layers.vectors.replaceChildren(...nodes(parts.vectors));
  layers.names.replaceChildren(...nodes(parts.names));
  measure(view);
  drawTracks(view);
  reframe(view, view.frame);
}

function allParts(scene, view) {
  const ground = scene.links.find((link) => link.ground)?.name;
  const moving = scene.links.filter((link) => !link.ground);
  const fixed = (one) => one.links.includes(ground);
  const slides = (one) => one.type === "prismatic";
  return {
    supports: scene.joints.filter((one) => fixed(one) && !slides(one)).map(support),
    guides: scene.joints.filter((one) => fixed(one) && slides(one)).map((one) => ({ joint: one, node: svg("path", { class: "hatch" }) })),
    bodies: moving.map((link, order) => body(link, order)),
    slots: slotsOf(scene, (name) => `k${moving.findIndex((link) => link.name === name) % 6}`).map((one) => marked(one, "links", one.joint.links[0])),
    gears: scene.gears.map((one) => gear(one)),
    points: scene.links.flatMap((link) => link.free.map((key) => ({ key, node: svg("g", { class: "point" }, svg("circle", { r: link.ground ? 3 : 4 })) }))),
    joints: [...scene.joints].sort((a, b) => Number(slides(b)) - Number(slides(a))).map((one) => joint(one)), // no block hides a pin
    springs: scene.springs.map((one) => spring(one)),
    loads: loadsOf(scene).map((one) => marked(one, "loads", one.name)),
    drives: scene.drivers.map((driver) => ({ driver, joint: scene.joints.find(({ name }) => name === driver.name), node: svg("path", { class: "drive" }) })).filter((one) => one.joint),
    vectors: scene.joints.map((one) => ({ node: svg("path", { class: `reaction ${view.kinds.get(one.name) ?? "k0"}` }) })),
    names: [...scene.joints.map((one) => nameOf(one.at, one.on, one.name, fixed(one), slides(one))), ...moving.flatMap((link) => link.free.map((key) => nameOf(key, key, key.slice(link.name.length + 1), false, false)))],
  }; // prettier-ignore
}

function simpleParts() {
  const empty = Object.fromEntries(["supports", "guides", "bodies", "slots", "gears", "points", "joints", "springs", "loads", "drives", "vectors", "names"].map((name) => [name, []]));
  return { ...empty, plain: [svg("path", { class: "plain-links" }), svg("path", { class: "plain-joints" })] };
}

function marked(part, kind, name) {
  if (name !== undefined) set(part.node, { "data-kind": kind, "data-name": name });
  return part;
}

function support(one) {
  let path = "M-20,19H20";
  for (let along = -15; along <= 20; along += 6.5) path += `M${along},19l-6,7`;
  return { joint: one, node: svg("g", {}, svg("path", { class: "bearing", d: "M0,0l-11,19h22Z" }), svg("path", { class: "hatch", d: path })) };
}

function body(link, order) {
  const kind = `k${order % 6}`;
  const parts = ["edge", "underlay", "plate"].map((name) => svg("path", { class: name === "underlay" ? name : `${name} ${kind}` }));
  const node = svg("g", { class: "body", "data-kind": "links", "data-name": link.name }, svg("title", {}, link.name), ...parts);
  return { link, parts, node };
}

function joint(one) {
  const shape = one.type === "prismatic" ? svg("rect", { x: -17, width: 34, y: -10, height: 20, rx: 1.5 }) : svg("circle", { r: 5 });
  return { joint: one, node: svg("g", { class: "joint", "data-name": one.name }, shape) };
}

function spring({ name, ends }) {
  const path = svg("path", { class: "spring" });
  const wide = svg("path", { class: "wide" });
  return { ends, parts: [path, wide], node: svg("g", { "data-kind": "springs", "data-name": name }, svg("title", {}, name), path, wide) };
}

function gear({ name, at: key, radius }) {
  const circles = ["pitch-circle", "wide"].map((kind) => svg("circle", { class: kind }));
  return { key, radius, circles, node: svg("g", { "data-kind": "gears", "data-name": name }, svg("title", {}, name), ...circles) };
}

function nameOf(key, other, name, grounded, slides) {
  const beside = slides ? [24, -15] : grounded ? [-19, 15] : [-11, -11];
  return { key, other, beside, name: short(name), node: svg("text", { class: "name" }, short(name)) };
}

/** Pixels a newton at which usual reactions are well seen. */
function measure(view) {
  const forces = view.scene.joints.map((one) => magnitude(one.reaction, view.scene.count));
  const most = usualPeak(view.scene, ...forces);
  view.usual = Math.max(Math.min(quantile(forces.flat(), 0.9), most), most / 2);
}

/** Pixels a newton. */
export function perNewton({ usual, frame, factor }) {
  return usual > 0 ? (factor * 0.18 * Math.min(frame.width, frame.height)) / usual : 0;
}

/** Coupler curves of free points, thin ones for moving joints, in metres. */
export function drawTracks(view) {
  const { scene, layers } = view;
  if (scene.count === 1 || view.parts.plain || view.shown.curves === false) return layers.tracks.replaceChildren();
  const keys = scene.links.filter((one) => !one.ground).flatMap((link) => link.points.map((key) => [key, link.free.includes(key)]));
  const moving = keys.filter(([key]) => scene.points[key] && (scene.points[key].x.length > 1 || scene.points[key].y.length > 1));
  layers.tracks.replaceChildren(...moving.map(([key, free]) => svg("path", { class: free ? "track free" : "track", d: trackPath(scene, key) })));
}

/** The path of a point in metres. */
export function trackPath(scene, key) {
  let path = "";
  let pen = "M";
  for (let index = 0; index < scene.count + (scene.abscissa.closed ? 1 : 0); index += 1) {
    const spot = place(scene, key, index % scene.count);
    if (spot) path += `${pen}${spot[0].toPrecision(7)},${spot[1].toPrecision(7)}`;
    pen = spot ? "L" : "M";
  }
  return path;
}

/** Guides on the ground: as long as their block travels. */
function poseGuides(view) {
  const { scene, frame } = view;
  for (const { joint: one, node } of view.parts.guides) {
    const angle = guide(scene, one, 0);
    const [ux, uy] = [Math.cos(angle), Math.sin(angle)];
    let [low, high, across] = [Infinity, -Infinity, 0];
    for (let index = 0; index < scene.count; index += 1) {
      const spot = place(scene, one.at, index);
      if (!spot) continue;
      const along = spot[0] * ux + spot[1] * uy;
      [low, high, across] = [Math.min(low, along), Math.max(high, along), spot[1] * ux - spot[0] * uy];
    }
    if (!(low <= high)) {
      set(node, { d: "" });
      continue;
    }
    const middle = (low + high) / 2;
    const [x, y] = frame.to([middle * ux - across * uy, middle * uy + across * ux]);
    const half = ((high - low) / 2) * frame.scale + 26;
    let path = `M${-half},11H${half}`;
    for (let tick = -half + 5; tick <= half && half < 4000; tick += 6.5) path += `M${tick.toFixed(1)},11l-6,7`;
    set(node, { d: path, transform: `translate(${x.toFixed(1)},${y.toFixed(1)}) rotate(${((-angle * 180) / Math.PI).toFixed(2)})` });
  }
}

/** Length bar and reference arrow, with round numbers. */
export function drawKey(view) {
  const { frame, layers, shown } = view;
  const y = frame.height - 16;
  const length = roundBelow(160 / frame.scale);
  const bar = length * frame.scale;
  const parts = [
    svg("path", { class: "bar", d: `M16,${y - 4}v8m0,-4h${bar}m0,-4v8` }),
    svg("text", { x: 24 + bar, y, dy: "0.32em" }, `${stated(length, "m")} · grid ${stated(gridStep(frame.scale), "m")}`),
  ];
  const scale = perNewton(view);
  if (scale > 0 && shown.reactions !== false) {
    const force = roundBelow(110 / scale);
    const x = frame.width - force * scale - KEY;
    parts.push(svg("path", { class: "reaction reference", d: arrow(x, y, force * scale, 0) }));
    parts.push(svg("text", { x: x + force * scale + 8, y, dy: "0.32em" }, `force in a joint ${stated(force, "N")}`));
  }
  layers.key.replaceChildren(...parts);
}

/** Move everything to a position of a scene of the same structure, or by a share of the way to the next. */
export function pose(view, scene, index, share = 0) {
  Object.assign(view, { scene, share, index: Math.min(index, scene.count - 1) });
  view.posed = posedAt(scene, view.index);
  view.exact = view.index + (view.index < scene.count - 1 || scene.abscissa.closed ? share : 0);
  const drawn = (view.drawn = view.posed === view.index ? view.exact : view.posed);
  const { parts, frame } = view;
  const known = solved(scene, view.index) || scene.count === 1;
  for (const name of ["bodies", "parts", "names"]) view.layers[name].classList.toggle("without-answer", !known);
  const spot = (key) => {
    const found = place(scene, key, drawn);
    return found && frame.to(found);
  };
  if (parts.plain) return posePlain(view, spot);
  const spots = (keys) => keys.map(spot).filter(Boolean);
  parts.supports.forEach(({ joint: one, node }) => moveTo(node, spot(one.on) ?? spot(one.at)));
  parts.bodies.forEach((one) => poseBody(one, spots(one.link.points)));
  parts.slots.forEach((one) => poseSlot(one, scene, frame, drawn));
  parts.points.forEach(({ key, node }) => moveTo(node, spot(key)));
  parts.joints.forEach(({ joint: one, node }) => moveTo(node, spot(one.at) ?? spot(one.on), one.type === "prismatic" ? guide(scene, one, drawn) : 0));
  parts.springs.forEach((one) => one.parts.forEach((part) => set(part, { d: coil(spots(one.ends)) })));
  parts.gears.forEach(({ key, radius, circles, node }) => {
    moveTo(node, spot(key));
    circles.forEach((one) => set(one, { r: radius * frame.scale }));
  });
  parts.loads.forEach((one) => {
    one.aim(scene, drawn);
    poseLoad(one, spots(one.keys), { width: frame.width, height: frame.height - LEGEND });
  });
  parts.drives.forEach((one) => poseDrive(view, one, spot(one.joint.at)));
  poseVectors(view, spot);
  poseNames(view, spot);
}

function posePlain({ scene, parts }, spot) {
  let links = "";
  let joints = "";
  for (const link of scene.links) links += closedPath(link.points.slice(0, 50).map(spot).filter(Boolean));
  for (const one of scene.joints) {
    const found = spot(one.at) ?? spot(one.on);
    if (found) joints += `M${found[0].toFixed(1)},${found[1].toFixed(1)}h0`;
  }
  set(parts.plain[0], { d: links });
  set(parts.plain[1], { d: joints });
}

function closedPath(spots) {
  const corners = hull(spots).map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`);
  return corners.length ? `M${corners.join("L")}${corners.length > 2 ? "Z" : "h0"}` : "";
}

function poseBody({ parts }, spots) {
  const path = closedPath(spots);
  parts.forEach((part) => part.setAttribute("d", path));
}

function moveTo(node, spot, angle = 0) {
  const turn = angle ? ` rotate(${((-angle * 180) / Math.PI).toFixed(2)})` : "";
  set(node, { transform: spot ? `translate(${spot[0].toFixed(1)},${spot[1].toFixed(1)})${turn}` : null, visibility: spot ? null : "hidden" });
}

/** An arc around a turning drive in the sense it turns; along its way, for a sliding one an arrow. */
function poseDrive({ scene, posed: index }, { driver, joint: one, node }, spot) {
  if (!spot) return set(node, { d: "" });
  const [x, y] = spot;
  const { values, period } = scene.abscissa;
  const forward = (scene.drivers[0] === driver && Math.sign(period || values[values.length - 1] - values[0])) || 1;
  if (driver.type === "prismatic") {
    const angle = guide(scene, one, index);
    const [ux, uy] = [Math.cos(angle), -Math.sin(angle)];
    return set(node, { d: arrow(x + 30 * uy, y - 30 * ux, 34 * forward * ux, 34 * forward * uy) });
  }
  const end = forward > 0 ? -1 : 1;
  const tip = [x + end * 19, y - 15];
  const head = `m${-end * 1.2},-8.2L${tip}l${-end * 8.2},-1.2`;
  return set(node, { d: `M${x - end * 19},${y - 15}A24.2,24.2 0 0 ${forward > 0 ? 0 : 1} ${tip}${head}` });
}

function poseVectors(view, spot) {
  const scale = perNewton(view);
  view.parts.vectors.forEach(({ node }, order) => {
    const one = view.scene.joints[order];
    const force = forceAt(view.scene, one, view.exact);
    const found = spot(one.at);
    const show = found && force && view.shown.reactions !== false;
    node.setAttribute("d", show ? arrow(found[0], found[1], force[0] * scale, -force[1] * scale) : "");
  });
}

/** Names that would stand on each other stand side by side. */
function poseNames({ parts, shown }, spot) {
  const there = new Map();
  for (const { key, other, beside, node, name } of parts.names) {
    const found = shown.names === false ? null : (spot(key) ?? spot(other));
    const at = found && [found[0] + beside[0], found[1] + beside[1]];
    const first = at && there.get(at.map(Math.round).join());
    moveTo(node, first ? null : at);
    if (first && !first.textContent.split(", ").includes(name)) first.textContent += `, ${name}`;
    if (first || !at) continue;
    node.textContent = name;
    there.set(at.map(Math.round).join(), node);
  }
}

