// The mechanism in space: bodies on a canvas, over them as SVG names, axes, loads, reactions and scales. Drag turns it.

import { arrow, longest } from "./arrow.js";
import { magnified, told } from "./built.js";
import { projection, steer } from "./camera.js";
import { at, cause, magnitude, peak, quantile, solved, usualPeak } from "./data.js";
import { html, onPaper, onWidth, set, svg } from "./dom.js";
import { roundBelow, short, stated } from "./format.js";
import { meshes, paint, seen, shades, stroke } from "./solids.js";
import { apply, plus, rotation, scaled } from "./vector.js";

const MARGIN = 46; // room for names and arrows, px
const KEY = 34; // height of the strip with triad and scales, px
const BELOW = 330; // height of what stands below the drawing, so that all of it stays in the window, px
const SHARP = 2; // canvas pixels for one of the page, at least: it is printed too
const RESIZED = 1.6; // a mechanism so many times as large, or as small, is fitted to the picture again
const REST = 160; // ms after which what was turned is drawn sharp again
const FITTED = 24; // positions whose bodies a turned view is fitted to
const LINE = 0.75; // half length of an axis, share of the size
const FAR = 1.5; // a screw axis farther from the middle than this many sizes is not drawn
const HALF = 0.03; // half length of a bearing as it is drawn, share of the size
const LOAD = 44; // length of a load, px
const ON_PAPER = { ink: "#1b1f24", muted: "#5a636e", ideal: "#c3c9d1", ground: "#9aa3ad", joint: "#f7f8fa",
  kinds: ["#0072b2", "#d55e00", "#009e73", "#b8578f", "#b97900", "#3b95cc"] }; // prettier-ignore

/** The vectors of a joint, as series, by what they are. */
const LOADS = {
  force: ({ reaction }) => [reaction],
  moment: ({ moment }) => [moment],
  end: ({ name }, { seats }) => (seats[name]?.ends ?? []).map(({ force }) => force),
};

/** What may be shown beside the bodies: label, and whether it is at the start. */
const EXTRAS = {
  names: ["names", true],
  tracks: ["paths of points", true],
  loads: ["loads", true],
  axes: ["joint axes", false],
  reactions: ["reactions", true],
  moments: ["reaction moments", false],
  ends: ["end loads of bearings", false],
  screws: ["screw axes", false],
};

/**
 * The drawing; `show(index)` moves it, `reactions(names, factor)` chooses the vectors, `take(scene, kinds, anew)` draws another scene
 * from the same side, or from its first; `controls` choose the rest. fill: it is as high as its place; after: is called whenever it was drawn, with the view.
 */
export function spaceView(scene, kinds, { fill = false, after = (_view) => {} } = {}) {
  const message = html("p", { class: "message", hidden: true });
  const stage = html("div", { class: "stage" });
  const element = html("div", { class: "mechanism space" }, stage, message);
  if (!scene.solids.length) {
    message.textContent = "The mechanism could not be assembled at any position.";
    message.hidden = false;
    element.classList.add("empty");
    return { element, controls: null, show() {}, reactions() {}, magnify() {}, take() {}, recolour() {} };
  }
  const view = {
    stage,
    message,
    index: 0,
    posed: 0,
    factor: 1,
    errors: 1,
    extras: new Set(Object.keys(EXTRAS).filter((name) => EXTRAS[name][1])),
    /** What is chosen, {kind, name}, or null: it is drawn in the accent. */
    chosen: null,
    fill,
    after,
    panel: html("div", {}),
    queued: 0,
    resting: 0,
  };
  embody(view, scene, kinds);
  settle(view);
  prepare(view);
  if (fill) new ResizeObserver(() => requestAnimationFrame(() => stage.clientWidth && build(view, stage.clientWidth))).observe(stage);
  else onWidth(stage, (width) => build(view, width), 490);
  steer(stage, { get: () => view.camera, put: (camera) => turn(view, camera), home: () => settle(view) });
  globalThis.matchMedia?.("(prefers-color-scheme: dark)").addEventListener("change", () => recolour(view, false));
  return {
    element,
    controls: view.panel,
    view,
    recolour: () => recolour(view, false),
    take(scene, kinds, anew) {
      embody(view, scene, kinds);
      Object.assign(view, { index: Math.min(view.index, scene.count - 1), project: null }); // nothing is drawn with the colours of other links
      recolour(view, false);
      const { around, above } = view.camera;
      const [more, less] = [scene.size / view.fitted.size, view.fitted.size / scene.size];
      if (anew || Math.max(more, less) > RESIZED) settle(view);
      if (!anew) Object.assign(view.camera, { around, above });
      if (view.frame) build(view, view.frame.width);
    },
    magnify(factor) {
      view.errors = factor;
      embody(view, view.base, view.kinds);
      view.fitted.reach = view.reach;
      turn(view, view.camera);
    },
    show(index) {
      view.index = index;
      pose(view);
    },
    reactions(names, factor) {
      view.shown = new Set(names);
      view.factor = factor;
      pose(view);
    },
  };
}

/** Links, bodies and tracks of a scene as its errors are magnified now. */
function embody(view, base, kinds) {
  const scene = magnified(base, view.errors);
  const common = (what) => usual(base, base.joints.flatMap((joint) => LOADS[what](joint, base).map((vector) => magnitude(vector, base.count)))); // prettier-ignore
  if (view.base !== base) {
    view.ideal = magnified(base, 0);
    view.shown = new Set(base.joints.map((joint) => joint.name));
    view.usual = { force: common("force"), moment: common("moment"), end: common("end") };
  }
  Object.assign(view, { base, scene, kinds });
  view.links = new Map(scene.links.map((link) => [link.name, link]));
  view.bodies = scene.solids.map((solid) => ({ solid, meshes: meshes(solid, scene.size) }));
  view.tracks = scene.free.map((point) => track(scene, view.links.get(point.link), point));
  view.reach = reach(view);
  view.panel.replaceChildren(...controls(view));
}

/** The first side to look from, with the whole of the present scene in the picture; it stays so until it is settled anew. */
function settle(view) {
  view.fitted = { view: view.scene.view, reach: view.reach, size: view.scene.size };
  view.camera = first(view.scene);
  if (view.frame) build(view, view.frame.width);
  return view.camera;
}


/** Where bodies come to over the run, at some of its positions: what a turned view is fitted to. */
function reach({ scene, links }) {
  const places = [];
  for (let index = 0; index < scene.count; index += Math.ceil(scene.count / FITTED)) {
    for (const solid of scene.solids) {
      const pose = poseOf(links.get(solid.link), index);
      if (pose) places.push(...solid.points.map((point) => plus(apply(pose.turn, point), pose.place)));
    }
  }
  return places;
}

/** A magnitude that arrows are scaled by: long ones stay in sight, common ones legible. */
function usual(scene, columns) {
  const most = usualPeak(scene, ...columns);
  return Math.max(Math.min(quantile(columns.flat(), 0.9), most), most / 2);
}

function first({ view: { around, above } }) {
  return { around, above, zoom: 1, shift: [0, 0] };
}

/** The elements that stay: a canvas for bodies, an SVG over it. */
function prepare(view) {
  view.canvas = html("canvas", { "aria-hidden": "true" });
  view.over = svg("svg", { "aria-hidden": "true" });
  set(view.stage, {
    tabindex: 0,
    role: "application", // so that a screen reader leaves it the arrow keys
    "aria-label":
      `Mechanism in space: ${view.scene.name}. Arrow keys turn it, with Shift they shift it, plus and minus zoom, ` +
      "0 is the first view.",
  });
  view.stage.replaceChildren(view.canvas, view.over);
  onPaper(Object.assign(view, { beforeprint: () => recolour(view, true), afterprint: () => recolour(view, false) }));
}

/** Colours of the page, or those for paper. */
function recolour(view, paper) {
  const style = paper ? null : globalThis.getComputedStyle?.(view.stage);
  const of = (name, plain) => style?.getPropertyValue(`--${name}`).trim() || plain;
  const colours = { ink: of("ink", ON_PAPER.ink), muted: of("muted", ON_PAPER.muted), ideal: of("strong", ON_PAPER.ideal), of: new Map() };
  colours.of.set("", shades(of("joint", ON_PAPER.joint)));
  view.halo = of("accent", ON_PAPER.kinds[0]);
  let order = 0;
  for (const link of view.scene.links) {
    colours.of.set(link.name, shades(link.ground ? of("ground", ON_PAPER.ground) : of(`k${order % 6}`, ON_PAPER.kinds[order % 6])));
    if (!link.ground) order += 1;
  }
  view.colours = colours;
  if (view.project) paintBodies(view);
}

function build(view, width) {
  const [left, below, right, above] = view.fitted.view.box;
  const wide = right - left || 1e-9;
  const tall = above - below || 1e-9;
  const height = view.fill ? Math.max(view.stage.clientHeight, 2 * MARGIN + 3 * KEY) : heightFor(width, tall / wide);
  const margin = Math.min(MARGIN, width * 0.1);
  const scale = Math.min((width - 2 * margin) / wide, (height - 2 * margin - KEY) / tall);
  view.frame = { width, height, scale, margin, middle: [(left + right) / 2, (below + above) / 2] };
  sharpen(view, SHARP);
  set(view.over, { viewBox: `0 0 ${width} ${height}` });
  if (!view.colours) recolour(view, false);
  view.perUnit = { force: fitting(view, "force"), moment: fitting(view, "moment"), end: fitting(view, "end") };
  pose(view);
}

/** So many pixels of the canvas for one of the page, at least: fewer while it is turned, for painting them takes longest. */
function sharpen(view, least) {
  const { width, height } = view.frame;
  const sharp = Math.max(globalThis.devicePixelRatio ?? 1, least);
  const size = { width: Math.round(width * sharp), height: Math.round(height * sharp) };
  view.context ??= view.canvas.getContext("2d");
  if (view.canvas.width === size.width && view.canvas.height === size.height) return false;
  set(view.canvas, size);
  view.context.setTransform(sharp, 0, 0, sharp, 0, 0);
  view.context.lineJoin = "round";
  view.context.lineCap = "round";
  return true;
}

/** The height of a picture in the flow of a page, px; `share`: of its height by its width. */
function heightFor(width, share) {
  const window = globalThis.window.innerWidth > 900 ? Math.max(globalThis.window.innerHeight - BELOW, 280) : 620;
  return Math.round(Math.min(Math.max((width - 2 * MARGIN) * share + 2 * MARGIN + KEY, width * 0.6), width * 0.95, window, 640));
}

/** Pixels a newton (or newton metre) at which every usual vector of the run ends inside the first view. */
function fitting(view, what) {
  const size = view.usual[what];
  if (!(size > 0)) return 0;
  const { scene, frame, fitted } = view;
  const camera = projection({ scene: fitted, frame, reach: fitted.reach, camera: first(fitted) }, KEY);
  const rays = [];
  for (const joint of scene.joints) {
    for (let index = 0; index < scene.count; index += Math.ceil(scene.count / 120)) {
      const spot = seat(view, joint.name, index);
      for (const vector of LOADS[what](joint, scene).map((one) => valueAt(one, index))) {
        if (!spot || !vector || Math.hypot(...vector) > 2 * size) continue;
        const [dx, dy] = apply(camera.matrix, vector);
        rays.push([...camera.to(apply(camera.matrix, spot)), dx, -dy]);
      }
    }
  }
  const room = { left: 6, right: frame.width - 6, top: 6, bottom: frame.height - KEY };
  return Math.min((Math.min(frame.width, frame.height) * 0.26) / size, Math.max(longest(rays, room), 30 / size));
}

/** A vector {x, y, z} of series at a position, or null. */
export function valueAt({ x, y, z }, index) {
  const value = [at(x, index), at(y, index), at(z, index)];
  return value.includes(null) ? null : value;
}

/** Rotation and place of a link, or null where it has none. */
export function poseOf({ pose }, index) {
  const place = [at(pose.x, index), at(pose.y, index), at(pose.z, index)];
  const turn = { w: at(pose.w, index), i: at(pose.i, index), j: at(pose.j, index), k: at(pose.k, index) };
  return place.includes(null) || Object.values(turn).includes(null) ? null : { turn: rotation(turn), place };
}

export function placed(view, link, point, index) {
  const pose = poseOf(view.links.get(link), index);
  return pose && plus(apply(pose.turn, point), pose.place);
}

export function seat(view, joint, index) {
  const one = view.scene.seats[joint];
  return one ? placed(view, one.link, one.at, index) : null;
}

/** The places of a free point over the run, closed over a whole turn. */
function track(scene, link, point) {
  const places = Array.from({ length: scene.count }, (_, index) => {
    const pose = poseOf(link, index);
    return pose && plus(apply(pose.turn, point.at), pose.place);
  });
  return { point, places: scene.abscissa.closed ? [...places, places[0]] : places, still: link.ground };
}

function turn(view, camera) {
  view.camera = camera;
  if (view.queued) return;
  view.queued = 1; // several events may come between two frames
  const draw = () => {
    view.queued = 0;
    if (view.frame) sharpen(view, 1);
    pose(view);
    clearTimeout(view.resting);
    view.resting = setTimeout(() => view.frame && sharpen(view, SHARP) && paintBodies(view), REST);
  };
  if (globalThis.requestAnimationFrame) globalThis.requestAnimationFrame(draw);
  else draw();
}

/** Everything at the present position and from the present side; where it cannot be assembled, the last pose in grey. */
function pose(view) {
  const { scene, index } = view;
  if (!view.frame) return;
  const known = (one) => scene.links.every((link) => poseOf(link, one));
  if (known(index)) view.posed = index;
  else if (!known(view.posed)) view.posed = Math.max(scene.status.findIndex((_, one) => known(one)), 0); // prettier-ignore
  const answered = solved(scene, index);
  view.stage.classList.toggle("without-answer", !answered);
  view.message.hidden = answered;
  view.message.textContent = answered ? "" : cause(scene, index);
  view.project = projection({ ...view, scene: view.fitted, reach: view.fitted.reach }, KEY);
  paintBodies(view);
  const parts = [];
  parts.push(...axes(view));
  if (view.extras.has("screws")) parts.push(...screws(view));
  if (view.extras.has("loads")) parts.push(...loads(view));
  parts.push(...vectors(view));
  if (view.extras.has("names")) parts.push(...names(view));
  view.over.replaceChildren(...parts, ...key(view));
  view.after(view);
}

function paintBodies(view) {
  const { scene, frame, context, colours, posed, project } = view;
  const pieces = [];
  const lit = view.chosen?.kind === "links" ? view.chosen.name : null;
  const poses = new Map(scene.links.map((link) => [link.name, poseOf(link, posed)]));
  for (const { solid, meshes: two } of view.bodies) {
    const pose = poses.get(solid.link);
    if (!pose) continue;
    if (solid.kind === "wire") {
      const places = solid.points.map((point) => plus(apply(pose.turn, point), pose.place));
      pieces.push(...stroke(places, colours.ink, 1, project, 0.003 * scene.size));
    }
    const halo = solid.link === lit ? view.halo : null;
    for (const mesh of two) for (const piece of seen(mesh, solid.paint, pose, project)) pieces.push(Object.assign(piece, { link: solid.link, halo }));
  }
  if (scene.factor > 1) pieces.push(...outline(view));
  if (view.extras.has("tracks"))
    for (const one of view.tracks) if (!one.still) pieces.push(...stroke(one.places, colours.ink, 1.4, project));
  context.clearRect(0, 0, frame.width, frame.height);
  paint(context, pieces, colours);
  view.pieces = pieces;
}

/** The link whose body is nearest to the viewer at a place of the picture, px; null where there is none. */
export function linkAt({ pieces = [] }, [x, y]) {
  const inside = (corners) =>
    corners.reduce((odd, [ax, ay], order) => {
      const [bx, by] = corners[(order + 1) % corners.length];
      return ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax) ? !odd : odd;
    }, false);
  return pieces.filter((piece) => piece.link && inside(piece.corners)).pop()?.link ?? null; // the nearest is painted last
}

/** The middle lines of the bodies where the ideal mechanism has them. */
function outline({ ideal, posed, colours, project }) {
  const poses = new Map(ideal.links.map((link) => [link.name, link.ground ? null : poseOf(link, posed)]));
  return ideal.solids.flatMap(({ kind, link, points }) => {
    const pose = poses.get(link);
    if (!pose || kind !== "rod") return [];
    const places = points.map((point) => plus(apply(pose.turn, point), pose.place));
    return stroke(places, colours.ideal, 3, project);
  });
}

/** A line through a place along a direction, both in the global frame, as an SVG path. */
function straight(view, place, along, half) {
  const ends = [-half, half].map((reach) => spot(view, plus(place, along, reach)).map((part) => part.toFixed(1)));
  return `M${ends[0]}L${ends[1]}`;
}

export function spot({ project }, place) {
  return project.to(apply(project.matrix, place));
}

/** The axes of the joints, or of the chosen one alone, dash-dotted through their symbols. */
function axes(view) {
  const all = view.extras.has("axes");
  return view.scene.joints.flatMap((joint) => {
    const lit = view.chosen?.kind === "joints" && view.chosen.name === joint.name;
    if (!all && !lit) return [];
    const place = seat(view, joint.name, view.posed);
    return (view.scene.seats[joint.name]?.axes ?? []).flatMap(({ link, along }) => {
      const pose = poseOf(view.links.get(link), view.posed);
      if (!place || !pose) return [];
      const d = straight(view, place, apply(pose.turn, along), 0.22 * view.scene.size);
      return [svg("path", { class: lit ? "joint-axis lit" : "joint-axis", d }, svg("title", {}, `axis of ${joint.name}`))];
    });
  });
}

/** The instantaneous screw axis of each moving link, or of the chosen one alone, against the ground, with its pitch. */
function screws(view) {
  const { scene, posed } = view;
  const moving = scene.links.filter((link) => !link.ground);
  const lines = [];
  const labels = [];
  const used = [];
  const chosen = view.chosen?.kind === "links" && moving.some(({ name }) => name === view.chosen.name) ? view.chosen.name : null;
  moving.forEach(({ name, screw }, order) => {
    if (chosen && name !== chosen) return;
    const place = screw && valueAt(screw, posed);
    const along = screw && valueAt({ x: screw.u, y: screw.v, z: screw.w }, posed);
    if (!place || !along || Math.hypot(...plus(place, scene.middle, -1)) > FAR * scene.size) return;
    const pitch = 2 * Math.PI * at(screw.pitch, posed);
    const slides = scene.scaled && Math.abs(pitch) > 1e-6 * scene.size;
    const text = slides ? `${short(name)}, ${stated(Number(pitch.toPrecision(3)), "m")} a turn` : short(name);
    lines.push(svg("path", { class: `screw k${order % 6}`, d: straight(view, place, along, LINE * scene.size) }));
    const [x, y] = roomFor(view, spot(view, plus(place, along, 0.9 * LINE * scene.size)), text, used);
    labels.push(svg("text", { class: `screw-name k${order % 6}`, x: x.toFixed(1), y: y.toFixed(1) }, text));
  });
  return [...lines, ...labels];
}

/** A place for a text inside the picture, clear of those that are `used`. */
function roomFor({ frame }, [x, y], text, used) {
  const half = 3.4 * text.length + 6;
  const foot = frame.height - KEY - (x < half + 60 ? 44 : 12); // clear of the triad
  const place = [Math.min(Math.max(x, half), frame.width - half), Math.min(Math.max(y, 14), foot)];
  const step = place[1] > frame.height / 2 ? -15 : 15;
  while (used.some((other) => Math.abs(other[0] - place[0]) < half + other[2] && Math.abs(other[1] - place[1]) < 15))
    place[1] += step;
  used.push([...place, half]);
  return place;
}

/** Reaction forces, moments with two heads, and loads on the ends of bearings, of the joints that are chosen. */
function vectors(view) {
  const { scene, index, kinds, factor } = view;
  return scene.joints.flatMap((joint) => {
    const place = seat(view, joint.name, view.posed);
    if (!place || !view.shown.has(joint.name)) return [];
    const parts = [];
    const add = (course, from, perUnit, more = "") => {
      const vector = valueAt(course, index);
      if (!vector || !from) return;
      const [x, y] = spot(view, from);
      const [dx, dy] = apply(view.project.matrix, vector).map((part) => part * perUnit * factor);
      let d = arrow(x, y, dx, -dy);
      if (more === " twist") d += head(x, y, dx, -dy);
      if (d) parts.push(svg("path", { class: "halo", d }), svg("path", { class: `reaction${more} ${kinds.get(joint.name)}`, d })); // prettier-ignore
    };
    if (view.extras.has("reactions")) add(joint.reaction, place, view.perUnit.force);
    if (view.extras.has("moments")) add(joint.moment, place, view.perUnit.moment, " twist");
    if (view.extras.has("ends")) for (const end of scene.seats[joint.name].ends) add(end.force, endAt(view, end, place), view.perUnit.end, " of-end");
    return parts;
  });
}

/** Where an end of a bearing is drawn whose middle is at a place; null where it has no pose. */
function endAt(view, { link, along }, middle) {
  const pose = poseOf(view.links.get(link), view.posed);
  return pose && plus(middle, apply(pose.turn, along), HALF * view.scene.size);
}

/** The second head of a moment: a shorter arrow on the same line. */
function head(x, y, dx, dy) {
  const length = Math.hypot(dx, dy);
  return length > 18 ? arrow(x, y, dx * (1 - 9 / length), dy * (1 - 9 / length)) : "";
}

/** Loads: a force as an arrow, a moment as one with two heads, of a length that is no scale. */
function loads(view) {
  return view.scene.loads.flatMap((load) => {
    const pose = poseOf(view.links.get(load.link), view.posed);
    if (!pose) return [];
    const [x, y] = spot(view, plus(apply(pose.turn, load.at), pose.place));
    const now = (what) => load.course?.[what]?.map((values) => values[view.posed] || 0) ?? load[what];
    return [[now("force"), "N", false], [now("moment"), "N m", true]].flatMap(([vector, unit, twice]) => {
      const size = Math.hypot(...vector);
      if (!(size > 0)) return [];
      const turned = load.frame === "link" ? apply(pose.turn, vector) : vector;
      const [dx, dy] = apply(view.project.matrix, scaled(turned, LOAD / size));
      const text = `${load.varies && !load.course ? "≤ " : ""}${stated(size, unit)}`;
      const [tx, ty] = [x + dx + (dx < 0 ? -7 : 7), y - dy + (dy < 0 ? 9 : -3)];
      return [
        svg(
          "g",
          { class: "load" },
          svg("title", {}, `${load.name}: ${text}`),
          svg("path", { d: arrow(x, y, dx, -dy) + (twice ? head(x, y, dx, -dy) : "") }),
          svg("text", { x: tx.toFixed(1), y: ty.toFixed(1), class: dx < 0 ? "end" : null }, text),
        ),
      ];
    });
  });
}

/** Names of joints and free points, away from the middle of the picture. */
function names(view) {
  const { scene, posed } = view;
  const spots = [
    ...scene.joints.map((joint) => [joint.name, seat(view, joint.name, posed), 24]),
    ...view.tracks.filter((one) => !one.still).map(({ point, places }) => [point.key.slice(point.link.length + 1), places[posed], 16]),
  ].flatMap(([name, place, away]) => (place ? [{ name, spot: spot(view, place), away }] : []));
  const middle = [0, 1].map((axis) => spots.reduce((sum, one) => sum + one.spot[axis], 0) / (spots.length || 1));
  return spots.map(({ name, spot: [x, y], away }) => {
    const [dx, dy] = [x - middle[0], y - middle[1]];
    const size = Math.hypot(dx, dy) || 1;
    const text = short(name);
    const wide = away + 3.6 * text.length;
    return svg("text", { class: "name", dy: "0.34em", x: (x + (dx / size) * wide).toFixed(1), y: (y + (dy / size) * away).toFixed(1) }, text);
  });
}

/** Triad, length bar and reference arrows, with round numbers. */
function key(view) {
  const { scene, frame, project } = view;
  const [ox, oy] = [46, frame.height - 46]; // its letters stay in the picture on any side
  const strip = { x: 0, y: frame.height - KEY + 6, width: frame.width, height: KEY - 6 };
  const parts = [svg("rect", { class: "strip", ...strip })];
  ["x", "y", "z"].forEach((name, axis) => {
    const [dx, dy] = project.matrix.slice(0, 2).map((row) => 26 * row[axis]);
    parts.push(svg("path", { class: "triad", d: arrow(ox, oy, dx, -dy) }));
    if (Math.hypot(dx, dy) > 6) parts.push(svg("text", { class: "axis middle", dy: "0.34em", x: (ox + 1.4 * dx).toFixed(1), y: (oy - 1.4 * dy).toFixed(1) }, name)); // prettier-ignore
  });
  const y = frame.height - 14;
  let x = 80;
  const say = (text) => {
    parts.push(svg("text", { x, y, dy: "0.32em" }, text));
    x += 7 * text.length + 16;
  };
  if (scene.scaled) {
    const length = roundBelow((frame.width * 0.16) / project.scale);
    const bar = length * project.scale;
    parts.push(svg("path", { class: "bar", d: `M${x},${y - 4}v8m0,-4h${bar.toFixed(1)}m0,-4v8` }));
    x += bar + 7;
    say(stated(length, "m"));
  } else say("all axes meet in one point");
  const reference = (perUnit, unit, text, second) => {
    const scale = perUnit * view.factor;
    if (!(scale > 0) || !Number.isFinite(scale) || !view.shown.size || x > frame.width - 130) return;
    const size = roundBelow((frame.width * 0.1) / scale);
    const d = arrow(x, y, size * scale, 0) + (second ? head(x, y, size * scale, 0) : "");
    parts.push(svg("path", { class: "reaction reference", d }));
    x += size * scale + 8;
    say(`${text} ${stated(size, unit)}`);
  };
  if (view.extras.has("reactions")) reference(view.perUnit.force, "N", "reaction", false);
  if (view.extras.has("moments")) reference(view.perUnit.moment, "N m", "moment", true);
  if (view.extras.has("ends")) reference(view.perUnit.end, "N", "on an end", false);
  if (scene.built) {
    const text = `errors × ${told(scene.factor)}${scene.factor > 1 ? ", ideal as pale lines" : ""}`;
    parts.push(svg("text", view.fill ? { class: "errors end", x: frame.width - 12, y } : { class: "errors", x: 14, y: 18 }, text));
  }
  return [svg("g", { class: "key" }, ...parts)];
}

/** What is shown, and the sides to look from. */
function controls(view) {
  const boxes = Object.entries(EXTRAS)
    .filter(([name]) => name !== "loads" || view.scene.loads.length)
    .filter(([name]) => name !== "tracks" || view.tracks.length)
    .filter(([name]) => name !== "reactions" || view.fill) // a report chooses them by their joints
    .filter(([name]) => name !== "ends" || Object.values(view.scene.seats).some(({ ends }) => ends.length))
    .filter(([name]) => name !== "moments" || peak(view.scene.joints.flatMap((one) => magnitude(one.moment, view.scene.count))) > 0)
    .map(([name, [label]]) => {
      const checked = view.extras.has(name);
      const box = html("input", { type: "checkbox", checked, value: name });
      box.checked = checked;
      box.addEventListener("change", () => {
        if (box.checked) view.extras.add(name);
        else view.extras.delete(name);
        pose(view);
      });
      return html("label", { class: "chip" }, box, label);
    });
  const sides = /** @type {[string, () => any, string][]} */ ([
    ["start", () => settle(view), "The first view"],
    ["x", () => ({ ...settle(view), around: 0, above: 0 }), "Look along the x axis"],
    ["y", () => ({ ...settle(view), around: -Math.PI / 2, above: 0 }), "Look along the y axis"],
    ["z", () => ({ ...settle(view), around: -Math.PI / 2, above: Math.PI / 2 }), "Look down the z axis"],
  ]).map(([label, camera, title]) => {
    const button = html("button", { type: "button", class: "plain", title, "aria-label": title }, label);
    button.addEventListener("click", () => turn(view, camera()));
    return button;
  });
  return [
    html("fieldset", { class: "vectors" }, html("legend", {}, "Show"), ...boxes),
    html("fieldset", { class: "vectors" }, html("legend", {}, "View"), ...sides),
  ];
}
