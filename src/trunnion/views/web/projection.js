// From metres to pixels: a mechanism in space seen from any side, fitted to the picture.

import { looking } from "./camera.js";
import { apply } from "./vector.js";

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
