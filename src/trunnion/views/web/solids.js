// Bodies of a spatial scene as facets, shaded and sorted by depth on a canvas: the nearer over the farther. Each body is
// there twice, once a little larger in ink, of which only what looks away is painted: that leaves its outline.

import { apply, cross, dot, plus, product, scaled, unit } from "./vector.js";

const SIDES = 14; // of a rod
const RINGS = 8; // of a ball
const STEP = 0.03; // bodies are cut into pieces of this share of the size: with twice that, crossing bars sort wrongly
const OUTLINE = 0.0028; // share of the size
const SHADES = 24;
const HALO = 7; // px
const LIGHT = [-0.35, 0.55, 0.76]; // from the left and above, in the picture's frame

/** The facets of a solid, [{points, faces, outline}]: corners in the link's frame, faces counter-clockwise from outside. */
export function meshes(solid, size) {
  if (solid.kind === "wire") return [];
  return [true, false].map((outline) => ({ ...grown(solid, outline ? OUTLINE * size : 0, STEP * size), outline }));
}

function grown({ kind, points, radius }, more, step) {
  if (kind === "rod") return rod(points, radius + more, more, step);
  return kind === "ball" ? ball(points[0], radius + more) : box(points, more, step);
}

/** A round rod along a line through points, mitred at its corners, with its two ends. */
function rod(corners, radius, more, step) {
  const line = cut(corners, step);
  const ways = line.slice(1).map((point, order) => unit(plus(point, line[order], -1)));
  const last = ways.length;
  line[0] = plus(line[0], ways[0], -more);
  line[last] = plus(line[last], ways[last - 1], more);
  const least = ways[0].map(Math.abs).reduce((best, part, axis, all) => (part < all[best] ? axis : best), 0);
  let x = cross(ways[0], [0, 1, 2].map((axis) => (axis === least ? 1 : 0)));
  const points = [];
  line.forEach((place, order) => {
    const [before, after] = [ways[Math.max(order - 1, 0)], ways[Math.min(order, last - 1)]];
    x = unit(x);
    const y = cross(before, x);
    const middle = plus(before, after); // the plane of the mitre lies across it
    const ring = Array.from({ length: SIDES }, (_, side) => {
      const angle = (2 * Math.PI * side) / SIDES;
      const spoke = plus(scaled(x, radius * Math.cos(angle)), y, radius * Math.sin(angle));
      return plus(spoke, before, -dot(spoke, middle) / dot(before, middle));
    });
    points.push(...ring.map((spoke) => plus(place, spoke)));
    x = plus(ring[0], after, -dot(ring[0], after)); // on the next piece the same line of the surface
  });
  const sides = Array.from({ length: SIDES }, (_, side) => side);
  const faces = [...cap(points, sides.map((side) => SIDES - 1 - side), step), ...cap(points, sides.map((side) => last * SIDES + side), step)];
  for (let order = 0; order < last; order += 1) faces.push(...around(order * SIDES, (order + 1) * SIDES));
  return { points, faces };
}

/** The end of a rod from its rim; a wide one, as of a disc, in rings of faces that sort, whose corners join the points. */
function cap(points, rim, step) {
  const middle = scaled(rim.reduce((sum, corner) => plus(sum, points[corner]), [0, 0, 0]), 1 / rim.length);
  const count = Math.floor(Math.hypot(...plus(points[rim[0]], middle, -1)) / step);
  const rings = [rim];
  for (let ring = 1; ring < count; ring += 1) {
    rings.push(rim.map((corner) => points.push(plus(middle, plus(points[corner], middle, -1), 1 - ring / count)) - 1));
  }
  const faces = rings.slice(1).flatMap((inner, order) =>
    inner.map((corner, side) => [rings[order][side], rings[order][(side + 1) % SIDES], inner[(side + 1) % SIDES], corner]),
  );
  return [...faces, rings[rings.length - 1]];
}

/** The line through the corners with more points on it, none farther from the next than a step. */
function cut(corners, step) {
  return corners.flatMap((end, order) => {
    if (order === 0) return [end];
    const start = corners[order - 1];
    const count = Math.max(1, Math.ceil(Math.hypot(...plus(end, start, -1)) / step));
    return Array.from({ length: count }, (_, piece) => plus(start, plus(end, start, -1), (piece + 1) / count));
  });
}

/** Faces between two rings of corners, from their first indices. */
function around(low, high) {
  return Array.from({ length: SIDES }, (_, side) => {
    const next = (side + 1) % SIDES;
    return [low + side, low + next, high + next, high + side];
  });
}

function ball(middle, radius) {
  const points = [];
  for (let ring = 0; ring <= RINGS; ring += 1) {
    const up = (ring / RINGS - 0.5) * Math.PI;
    for (let side = 0; side < SIDES; side += 1) {
      const angle = (2 * Math.PI * side) / SIDES;
      points.push(plus(middle, [Math.cos(up) * Math.cos(angle), Math.cos(up) * Math.sin(angle), Math.sin(up)], radius));
    }
  }
  const faces = Array.from({ length: RINGS }, (_, ring) => around(ring * SIDES, (ring + 1) * SIDES)).flat();
  return { points, faces };
}

/** A box from its middle and half edges, its sides cut into pieces. */
function box([middle, ...halves], more, step) {
  const [u, v, edge] = halves.map((half) => scaled(half, 1 + more / Math.hypot(...half)));
  const w = dot(cross(u, v), edge) < 0 ? scaled(edge, -1) : edge;
  const points = [];
  const faces = [];
  for (const [a, b, c] of [[u, v, w], [v, w, u], [w, u, v]]) {
    const [across, up] = [a, b].map((one) => Math.ceil((2 * Math.hypot(...one)) / step));
    const corner = (i, j, side) =>
      plus(plus(plus(middle, c, side), a, -1 + (2 * i) / across), b, -1 + (2 * j) / up);
    for (let i = 0; i < across; i += 1) {
      for (let j = 0; j < up; j += 1) {
        for (const side of [1, -1]) {
          const square = [corner(i, j, side), corner(i + 1, j, side), corner(i + 1, j + 1, side), corner(i, j + 1, side)];
          const order = [0, 1, 2, 3].map((one) => points.length + one);
          points.push(...square);
          faces.push(side > 0 ? order : order.reverse());
        }
      }
    }
  }
  return { points, faces };
}

/**
 * What is seen of the meshes of one link, as pieces [{depth, corners, paint}] in pixels. `pose` {turn, place} is the link's;
 * `camera` {matrix, to}: `to` maps [right, up] in metres to pixels.
 */
export function seen({ points, faces, outline }, paint, { turn, place }, { matrix, to }) {
  const both = product(matrix, turn);
  const shift = apply(matrix, place);
  const turned = points.map((point) => plus(apply(both, point), shift));
  const pieces = [];
  for (const face of faces) {
    const corners = face.map((index) => turned[index]);
    const normal = cross(plus(corners[2], corners[0], -1), plus(corners[3 % corners.length], corners[1], -1));
    if (normal[2] > 0 === outline) continue;
    const depth = corners.reduce((sum, corner) => sum + corner[2], 0) / corners.length;
    const shade = outline ? "ink" : Math.round(Math.min(Math.max(dot(unit(normal), LIGHT), 0), 1) * (SHADES - 1));
    pieces.push({ depth, corners: corners.map(to), paint, shade });
  }
  return pieces;
}

/** A line through places in the global frame, as pieces that sort among those of the bodies. */
export function stroke(places, colour, width, { matrix, to }, forward = 0) {
  const turned = places.map((place) => place && apply(matrix, place));
  return turned.slice(1).flatMap((end, order) => {
    const start = turned[order];
    if (!start || !end) return [];
    return [{ depth: (start[2] + end[2]) / 2 + forward, corners: [to(start), to(end)], colour, width }];
  });
}

/** Shades of a colour "#rrggbb" from dark to lit. */
export function shades(colour) {
  const parts = [1, 3, 5].map((place) => Number.parseInt(colour.slice(place, place + 2), 16));
  return Array.from({ length: SHADES }, (_, order) => {
    const bright = order / (SHADES - 1);
    const white = (0.38 * Math.max(0, bright - 0.55)) / 0.45;
    const lit = parts.map((part) => Math.round(part * (0.62 + 0.38 * bright) * (1 - white) + 255 * white));
    return `rgb(${lit.join(",")})`;
  });
}

/** Paint pieces on a canvas context; `colours` has the shades `of` each paint, and the `ink` of the outline. */
export function paint(context, pieces, colours) {
  pieces.sort((a, b) => a.depth - b.depth);
  for (const piece of pieces) {
    context.beginPath();
    piece.corners.forEach(([x, y], order) => (order ? context.lineTo(x, y) : context.moveTo(x, y)));
    if (piece.colour) {
      context.lineWidth = piece.width;
      context.strokeStyle = piece.colour;
    } else {
      const halo = piece.shade === "ink" ? piece.halo : null; // of what is chosen the outline is broad
      const colour = halo ?? (piece.shade === "ink" ? colours.ink : colours.of.get(piece.paint)[piece.shade]);
      context.closePath();
      context.fillStyle = colour;
      context.fill();
      context.strokeStyle = colour; // else the paper shows between neighbours
      context.lineWidth = halo ? HALO : 0.6;
    }
    context.stroke();
  }
}
