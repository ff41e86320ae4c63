// The scene that is shown and the part of the plane that the window looks at.

import { computed } from "@preact/signals";
import { kindOf } from "../web/report.js";
import { drawing, fitted, frameOf, reframe } from "./drawing.js";
import { assembled, extentOf, gridStep, nearOf, sketch, snap, spotsOf } from "./geometry.js";
import * as state from "./state.js";

/** The scene that is shown, and what its parts are built from. */
export const shown = computed(() => {
  const found = state.answer.value;
  if (!found || state.spatial.value) return null;
  if (!state.solved.value || !assembled(found.scene)) {
    const scene = sketch(found.entries, state.places.value, found.numbers);
    return { scene: found.tracks ? { ...scene, points: found.tracks } : scene, structure: scene, sketched: true };
  }
  const scene = state.live.value?.points ? moved(found.scene, state.live.value) : found.scene;
  return { scene, structure: found, sketched: false };
});

/** The scene with points and angles of a mechanism that is dragged. */
function moved(scene, { points, angles, status }) {
  const links = scene.links.map((link) => (angles?.[link.name] ? { ...link, angle: angles[link.name] } : link));
  return { ...scene, links, points: { ...scene.points, ...points }, status: status ?? scene.status };
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
  /** Puts the picture behind the grid where it belongs. */
  photo: () => {},
  fit() {
    const { width, height } = sheet.view.frame;
    const { scene } = shown.peek() ?? {};
    look(fitted(width, height, scene && extentOf(scene)));
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
  spots: () => (sheet.view?.scene ? spotsOf(sheet.view.scene, sheet.view.posed) : []),
  /** What lies at a place: a joint, a point, or the grid; `loose` leaves the grid out. */
  snap(at, loose = false) {
    const step = sheet.step() / (loose || !state.snapping.value ? 100 : 1);
    return snap(sheet.spots(), at, { near: nearOf(sheet.view.frame.scale), step });
  },
};

function middle() {
  const { width, height } = sheet.view.frame;
  return [width / 2, height / 2];
}

function look(frame) {
  reframe(sheet.view, frame);
  sheet.photo();
  sheet.after();
}
