// The scene that is shown and the part of the plane that the window looks at.

import { computed } from "@preact/signals";
import { magnified } from "../web/built.js";
import { kindOf } from "../web/report.js";
import { drawing, fitted, frameOf, reframe } from "./drawing.js";
import { place } from "../web/data.js";
import { assembled, crossing, extentOf, gridStep, nearOf, onLine, sketch, snap, spotsOf } from "./geometry.js";
import * as state from "./state.js";

/** The scene that is shown, and what its parts are built from. */
export const shown = computed(() => {
  const found = state.answer.value;
  if (!found || state.spatial.value) return null;
  if (!state.solved.value || !assembled(found.scene)) {
    const scene = sketch(found.entries, state.places.value, found.numbers);
    return { scene, structure: scene, sketched: true };
  }
  const live = state.live.value;
  const scene = live?.points && tells(live, state.index.value) ? changing(found.scene, live) : found.scene;
  return { scene, structure: found, sketched: false };
});

/** Whether an answer about a mechanism that is being changed tells of a position: of many joints it tells of one alone. */
export const tells = (live, index) => !live.tracks || live.index === index;

/** The scene with the motion and forces of a mechanism that is being changed. */
export function changing(scene, { points, tracks, angles, efforts, joints, status }) {
  return {
    ...scene,
    tracks,
    links: scene.links.map((link) => ({ ...link, angle: angles[link.name] ?? link.angle })),
    points: { ...scene.points, ...points },
    drivers: scene.drivers.map((one) => ({ ...one, effort: efforts[one.name] ?? one.effort })),
    joints: scene.joints.map((one) => {
      const { x, y, ...rest } = joints[one.name] ?? one.reaction; // it may be of the sheet before
      return { ...one, ...rest, reaction: { x, y } };
    }),
    status: tracks ? scene.status.map(() => status[0]) : status, // of one position, the only one that is shown of it
  };
}

/** The worst corner that is looked at, or null. */
export const cornered = computed(() => (state.corner.value?.of === state.answer.value?.scene ? state.corner.value : null));

/**
 * What is drawn: the same with errors and play magnified, or at a worst corner, while nothing is dragged or drawn. Then
 * `ideal` is the scene without them, and `of` of both that by which the mechanism is changed.
 * @type {{ value: any, peek: () => any }}
 */
export const drawn = computed(() => {
  const found = shown.value;
  if (!found || found.sketched || state.live.value || state.tool.value !== "select") return found;
  const source = cornered.value?.scene ?? found.scene;
  if (!source.built || (state.factor.value === 1 && !cornered.value)) return found;
  const [scene, ideal] = [state.factor.value, 0].map((factor) => ({ ...magnified(source, factor), of: found.scene }));
  return { ...found, scene, ideal, structure: cornered.value ?? found.structure };
});

/** Whether what is drawn lies elsewhere than it is; says what to do before it is changed. */
export function apart() {
  if (!drawn.peek()?.ideal) return false;
  state.say(`Lengths are changed where errors are drawn × 1${cornered.peek() ? " and as they are" : ""}.`, true);
  return true;
}

/** Colour classes of the joints, as the report has them. */
export function kindsOf(scene) {
  return new Map(scene.joints.map((joint, order) => [joint.name, kindOf(order)]));
}

/** The view while the sheet is on the page, and what moves the window; `after` is called when it has moved. */
export const sheet = {
  /** @type {ReturnType<typeof drawing> | null} */
  view: null,
  after: () => {},
  /** What is drawn beside it, [{points}]. @type {() => {points: object}[]} */
  beside: () => [],
  fit() {
    const { width, height } = sheet.view.frame;
    const { scene, ideal } = drawn.peek() ?? {};
    const points = Object.assign({}, scene?.points, ideal && prefixed(ideal.points, "ideal"), ...sheet.beside().map((one, order) => prefixed(one.points, order)));
    look(fitted(width, height, scene && extentOf({ ...scene, points })));
  },
  zoom(factor, [x, y] = middle()) {
    const { width, height, scale, left, foot } = sheet.view.frame;
    const next = Math.min(Math.max(scale * factor, 0.01), 1e7);
    const by = next / scale;
    look(frameOf(width, height, next, x + (left - x) * by, y + (foot - y) * by));
  },
  pan(dx, dy) {
    const { width, height, scale, left, foot } = sheet.view.frame;
    look(frameOf(width, height, scale, left + dx, foot + dy));
  },
  resize(width, height) {
    const { scale, left, foot, width: before, height: above } = sheet.view.frame;
    look(frameOf(width, height, scale, left + (width - before) / 2, foot + (height - above) / 2));
  },
  /** Distance of the grid's lines, m. */
  step: () => gridStep(sheet.view.frame.scale),
  /** What a hand can tell apart, m: a thousandth of the grid, some hundredths of a pixel. */
  fine: () => (sheet.view ? sheet.step() / 1000 : sheet.finest),
  /** The same of a picture in space. */
  finest: 0,
  /** Width of the window and reach of a click, m. */
  scale: () => ({ wide: sheet.view.frame.width / sheet.view.frame.scale, near: nearOf(sheet.view.frame.scale) }),
  spots: () => (sheet.view?.scene ? spotsOf(sheet.view.scene.of ?? sheet.view.scene, sheet.view.drawn) : []),
  /** What lies at a place: a joint or a point no farther than `near` m, or the grid; `loose` leaves the grid out. */
  snap(at, loose = false, near = nearOf(sheet.view.frame.scale)) {
    const step = sheet.step() / (loose || !state.snapping.value ? 100 : 1);
    return snap(sheet.spots(), at, { near, step });
  },
  /** The same with the link `part` under it, {…, on: link}, where the tool takes links and no joint or point is near. */
  snapOn(at, loose, part, near) {
    const spot = sheet.snap(at, loose, near);
    if (spot.kind || part?.kind !== "links") return spot;
    return { ...spot, on: part.name, at: onLine(pointsOf(part.name), spot.at, near ?? nearOf(sheet.view.frame.scale)) };
  },
};

/** What lies at a place of the sheet, [{kind, name, key}], the uppermost first. */
export function partsAt(at) {
  const [x, y] = sheet.view.frame.to(at);
  const box = sheet.view.root.getBoundingClientRect();
  return document.elementsFromPoint(x + box.left, y + box.top).map(partUnder).filter(Boolean);
}

/** What a pointer is over: {kind, name, key}, or null. */
export function partUnder(target) {
  const node = target?.closest?.("[data-kind]");
  return node ? { kind: node.dataset.kind, name: node.dataset.name, key: node.dataset.key } : null;
}

/** Two moving links that cross at a place, {on: [first, second], at: where exactly}; null where there is one link or none. */
export function crossingAt(at) {
  const names = [...new Set(partsAt(at).filter(({ kind }) => kind === "links").map(({ name }) => name))];
  if (names.length < 2) return null;
  return { on: names.slice(0, 2), at: crossing(pointsOf(names[0]), pointsOf(names[1]), at, nearOf(sheet.view.frame.scale)) };
}

/** Where the points of a link are shown. */
function pointsOf(link) {
  const { scene, posed } = sheet.view;
  return (scene.links.find(({ name }) => name === link)?.points ?? []).map((key) => place(scene, key, posed)).filter(Boolean);
}

/** The moving links of a joint or point. */
export function linksOf({ kind, name }) {
  return kind === "joints" ? (sheet.view.scene.joints.find((one) => one.name === name)?.links ?? []) : [name.split(".")[0]];
}

/**
 * What an end that is dragged to a place would be joined with there: another end, or a place on a link that is not its own; null where
 * there is nothing. Only a mechanism that is not whole yet has ends to be joined, and of two joints neither is one.
 */
export function dropAt(held, at) {
  const own = linksOf(held);
  const apart = (one) => !linksOf(one).some((link) => own.includes(link)) && (held.kind === "points" || one.kind === "points");
  const near = snap(sheet.spots().filter(apart), at, { near: nearOf(sheet.view.frame.scale), step: 1 });
  if (near.kind) return near;
  const link = held.kind === "points" && partsAt(at).find(({ kind, name }) => kind === "links" && !own.includes(name));
  return link ? { kind: null, on: link.name, at: onLine(pointsOf(link.name), at, nearOf(sheet.view.frame.scale)) } : null;
}

/** The one moving link at a joint or point, beside `own`; null where there are several. */
export function linkOf({ kind, name, link }, own = null) {
  if (kind === "points") return link;
  const joint = kind === "joints" && sheet.view.scene.joints.find((one) => one.name === name);
  const ground = sheet.view.scene.links.find((one) => one.ground)?.name;
  const moving = joint ? joint.links.filter((one) => one !== ground && one !== own) : [];
  return moving.length === 1 ? moving[0] : null;
}

/** The slide or pivot on the ground that a clicked joint, or the link at a clicked place, moves in; undefined where there is none. */
export function resisted({ kind, name, on }) {
  const { scene, posed } = sheet.view;
  const ground = scene.links.find((one) => one.ground)?.name;
  const grounded = scene.joints.filter((one) => one.links.includes(ground) && ["prismatic", "revolute"].includes(one.type));
  const clicked = scene.joints.find((one) => kind === "joints" && one.name === name);
  const spot = clicked && place(scene, clicked.at, posed);
  const held = (one) => (on ? one.links.includes(on) : clicked && String(place(scene, one.at, posed)) === String(spot));
  const found = grounded.filter((one) => held(one));
  return found.find(({ type }) => type === "prismatic") ?? found[0];
}

/** Points with names of their own. */
function prefixed(points, order) {
  return Object.fromEntries(Object.entries(points).map(([key, track]) => [`${order} ${key}`, track]));
}

function middle() {
  const { width, height } = sheet.view.frame;
  return [width / 2, height / 2];
}

function look(frame) {
  reframe(sheet.view, frame);
  sheet.after();
}
