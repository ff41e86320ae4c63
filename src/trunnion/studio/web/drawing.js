// The mechanism in the window as SVG: parts are built once for a structure and moved for every position.

import { arrow } from "../web/arrow.js";
import { solved } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { roundBelow, stated } from "../web/format.js";
import { forcesOf, outline, partsOf, poseParts, sizesOf, standing, tracksOf } from "../web/plane.js";
import { gridStep, posedAt } from "./geometry.js";

const MANY = 2000; // parts above which each kind is one plain path
export const KEY = 168; // px, room for the words of the key at the right edge
const LEGEND = 30; // px at the foot, where scale and key stand
export const TARGET = 12; // px, radius of what a pointer may hit

/** The drawing of a scene in an SVG element; `draw(scene)` builds, `pose(…)` moves, `fit` and `zoom` change the frame. */
export function drawing(root) {
  const layers = Object.fromEntries(
    ["grid", "tracks", "ghosts", "ground", "bodies", "parts", "vectors", "names", "handles", "tools", "key"].map((name) => [
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
  const margin = 0.14 * Math.min(width, height); // for arrows, which are as much longer in a larger window
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

const NOUNS = { links: "Link", loads: "Load", springs: "Spring", gears: "Gear pair" };
const REACHED = 400; // parts that keys go through; of more the list under Properties chooses
const PARTS = "g.body[data-kind], .parts g[data-kind]"; // those that are a part by themselves

/** Links, loads, springs and gears that Tab reaches; what was in focus stays so. */
function reachable({ root }, focused) {
  const nodes = [...root.querySelectorAll(PARTS)].slice(0, REACHED);
  for (const node of nodes) set(node, { tabindex: 0, role: "button", "aria-label": `${NOUNS[node.dataset.kind]} ${node.dataset.name}` });
  if (focused) nodes.find(({ dataset }) => dataset.kind === focused.kind && dataset.name === focused.name)?.focus();
}

/** Build the parts of a scene. `kinds`: class of the colour of each joint. */
export function build(view, scene, kinds) {
  Object.assign(view, { scene, kinds, index: Math.min(view.index, scene.count - 1) });
  const simple = scene.links.length > MANY || scene.joints.length > MANY;
  view.plain = simple ? [svg("path", { class: "plain-links" }), svg("path", { class: "plain-joints" })] : null;
  view.parts = partsOf(simple ? { ...scene, links: [], joints: [], springs: [], loads: [], gears: [], drivers: [] } : scene, kinds);
  for (const { paths, node } of [...view.parts.springs, ...view.parts.gears]) {
    paths.push(svg(paths[0].tagName, { class: "wide" })); // what a pointer hits
    node.append(paths[1]);
  }
  const { layers, parts, root } = view;
  const active = document.activeElement;
  const focused = active instanceof SVGElement && root.contains(active) && active.matches(PARTS) ? { ...active.dataset } : null;
  const fill = (layer, ...names) => layers[layer].replaceChildren(...names.flatMap((name) => parts[name].map((one) => one.node)));
  fill("ground", "supports", "guides");
  fill("bodies", "bodies", "slots", "cylinders");
  fill("parts", "gears", "points", "walls", "joints", "springs", "drives", "loads");
  fill("vectors", "vectors");
  fill("names", "names");
  layers.parts.append(...(view.plain ?? []));
  reachable(view, focused);
  view.usual = sizesOf(scene, forcesOf(scene)).usual;
  drawTracks(view);
  reframe(view, view.frame);
}

/** Pixels a newton. */
export function perNewton({ usual, frame, factor }) {
  return usual > 0 ? (factor * 0.18 * Math.min(frame.width, frame.height)) / usual : 0;
}

/** Coupler curves of free points, thin ones for moving joints, in metres. */
export function drawTracks({ scene, layers, plain, shown }) {
  const none = scene.count === 1 || plain || shown.curves === false;
  const paths = none ? [] : tracksOf(scene, metres, layers.tracks.children);
  if (paths.length !== layers.tracks.childElementCount) layers.tracks.replaceChildren(...paths);
}

/** A place as text of a path in metres. */
export function metres(spot) {
  return spot.map((one) => one.toPrecision(7)).join();
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
  if (scale > 0 && (shown.reactions !== false || view.parts.loads.some(({ force }) => force))) {
    const force = roundBelow(110 / scale);
    const x = frame.width - force * scale - KEY;
    parts.push(svg("path", { class: "reaction reference", d: arrow(x, y, force * scale, 0) }));
    parts.push(svg("text", { x: x + force * scale + 8, y, dy: "0.32em" }, `force ${stated(force, "N")}`));
  }
  layers.key.replaceChildren(...parts);
}

/** Move everything to a position of a scene of the same structure, or by a share of the way to the next. */
export function pose(view, scene, index, share = 0) {
  Object.assign(view, { scene, share, index: Math.min(index, scene.count - 1) });
  view.posed = posedAt(scene, view.index);
  view.exact = view.index + (view.index < scene.count - 1 || scene.abscissa.closed ? share : 0);
  view.drawn = view.posed === view.index ? view.exact : view.posed;
  const { frame, layers, parts, shown } = view;
  const known = solved(scene, view.index) || scene.count === 1;
  for (const name of ["bodies", "parts", "names"]) layers[name].classList.toggle("without-answer", !known);
  const room = { width: frame.width, height: frame.height - LEGEND };
  const more = { perNewton: perNewton(view), force: view.exact, shown: () => shown.reactions !== false, named: shown.names !== false, forward: 1, room };
  const now = standing(scene, frame, view.drawn, more);
  if (view.plain) posePlain(view, now);
  else poseParts(parts, now);
}

function posePlain({ scene, plain }, { spot, spots }) {
  const joints = scene.joints.map((one) => spot(one.at) ?? spot(one.on)).filter(Boolean);
  set(plain[0], { d: scene.links.map((link) => outline(spots(link.points.slice(0, 50)))).join("") });
  set(plain[1], { d: joints.map(([x, y]) => `M${x.toFixed(1)},${y.toFixed(1)}h0`).join("") });
}
