// The camera of a spatial drawing: parallel projection, turned, shifted and zoomed by mouse, fingers and keys.

import { apply } from "./vector.js";

const TURN = 0.0085; // rad a pixel
const STEP = Math.PI / 24; // rad a key
const NUDGE = 30; // px a key
const FACTOR = 1.2; // a key of zoom

/** Rows right, up and towards the viewer; around z (0: on the x axis) and above the x–y plane, rad. */
export function looking(around, above) {
  const [c, s] = [Math.cos(around), Math.sin(around)];
  const [ca, sa] = [Math.cos(above), Math.sin(above)];
  return [[-s, c, 0], [-sa * c, -sa * s, ca], [ca * c, ca * s, sa]];
}

/** A view {around, above, zoom, shift} after a turn by pixels; never over the pole. */
export function turned(view, dx, dy) {
  const above = Math.min(Math.max(view.above + dy * TURN, -Math.PI / 2), Math.PI / 2);
  return { ...view, around: view.around - dx * TURN, above };
}

export function shifted(view, dx, dy) {
  return { ...view, shift: [view.shift[0] + dx, view.shift[1] + dy] };
}

/** Zoomed so that what lies `from` the middle of the picture (px) stays there. */
export function zoomed(view, factor, from = [0, 0]) {
  const zoom = Math.min(Math.max(view.zoom * factor, 0.2), 40);
  const share = zoom / view.zoom;
  return { ...view, zoom, shift: [0, 1].map((axis) => from[axis] + (view.shift[axis] - from[axis]) * share) };
}

/** The view after a key, or null if it is none of ours. */
export function keyed(view, key, shift, home) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  if (arrows[key]) {
    const [dx, dy] = arrows[key];
    if (shift) return shifted(view, -dx * NUDGE, -dy * NUDGE);
    return turned(view, (-dx * STEP) / TURN, (-dy * STEP) / TURN);
  }
  if (key === "+" || key === "=") return zoomed(view, FACTOR);
  if (key === "-") return zoomed(view, 1 / FACTOR);
  return key === "0" ? home : null;
}

/** Let mouse, fingers and keys on `element` change the view; `get()` and `put(view)` hold it, `home()` is the first one. */
export function steer(element, { get, put, home }) {
  const fingers = new Map();
  element.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    element.setPointerCapture?.(event.pointerId);
  });
  element.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    fingers.set(event.pointerId, now);
    if (fingers.size === 2) {
      const [, other] = [...fingers].find(([id]) => id !== event.pointerId);
      const apart = (spot) => Math.hypot(spot[0] - other[0], spot[1] - other[1]) || 1;
      put(shifted(zoomed(get(), apart(now) / apart(before)), dx / 2, dy / 2));
    } else if (event.buttons > 1 || event.shiftKey) put(shifted(get(), dx, dy));
    else put(turned(get(), dx, dy));
  });
  const release = (event) => fingers.delete(event.pointerId);
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) element.addEventListener(name, release);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const box = element.getBoundingClientRect();
      const from = [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
      put(zoomed(get(), Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), from));
    },
    { passive: false },
  );
  element.addEventListener("dblclick", () => put(home()));
  element.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const view = event.key === "0" ? home() : keyed(get(), event.key, event.shiftKey, null);
    if (!view) return;
    event.preventDefault(); // the crank, which has these keys elsewhere, leaves such events alone
    put(view);
  });
}

// ---- from metres to pixels -----------------------------------------------------------------------------------------

/** The projection of the present camera: matrix, and `to` from [right, up] in metres to pixels.
 * below: height of the strip below it, px.
 *
 * The first view has the whole box in the middle of the picture; turned, the mechanism is fitted to the picture again.
 */
export function projection({ scene, camera, frame, reach }, below) {
  const matrix = looking(camera.around, camera.above);
  const first = extent(reach, looking(scene.view.around, scene.view.above));
  const now = extent(reach, matrix);
  const room = [frame.width, frame.height - below].map((length) => length - 2 * frame.margin);
  const fit = ({ size }) => Math.min(room[0] / size[0], room[1] / size[1]);
  const refit = reach.length ? fit(now) / fit(first) : 1;
  const scale = frame.scale * camera.zoom * refit;
  const moved = (at, axis) => now.middle[axis] + (at - first.middle[axis]) / refit;
  const middle = reach.length ? frame.middle.map(moved) : frame.middle;
  const x = frame.width / 2 + camera.shift[0];
  const y = (frame.height - below) / 2 + camera.shift[1];
  return { matrix, scale, to: (/** @type {number[]} */ [right, up]) => [x + (right - middle[0]) * scale, y - (up - middle[1]) * scale] };
}

/** Middle and extent, [right, up] m, of all that bodies reach, seen by a matrix. */
export function extent(places, matrix) {
  const seen = places.map((place) => apply(matrix, place));
  const ends = [0, 1].map((axis) => {
    const along = seen.map((at) => at[axis]);
    return [least(along), -least(along.map((at) => -at))];
  });
  return { middle: ends.map(([low, high]) => (low + high) / 2), size: ends.map(([low, high]) => high - low || 1e-9) };
}

function least(values) {
  return values.reduce((low, value) => Math.min(low, value), Infinity);
}
