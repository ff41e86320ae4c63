// Reading a scene (trunnion/views/scene.py): series, vectors, extents, state. No drawing here.

import { stated } from "./format.js";

const CONTACT_LOST = 3; // errors.Status
/** What a chart says of a peak that it cuts; whole: of a scene, how it is seen. */
export const outside = ({ whole = "--uncut shows it." }) => `near a dead centre is outside the frame; ${whole}`;

const FIRST_UNSOLVED = 4; // errors.Status.NOT_CONVERGED: from here on the forces have no value

/**
 * The value of a series at a position; a series of one number holds everywhere. Between two positions (index 3.4) it is
 * on the straight line between their values, where both are known.
 */
export function at(series, index) {
  if (!series || series.length === 0) return null;
  if (series.length === 1) return series[0];
  return Number.isInteger(index) ? series[index] : between(series, index, (change) => change);
}

/** An angle at a position, rad; between two positions it turns the short way. */
export function angleAt(series, index) {
  if (!series || series.length < 2 || Number.isInteger(index)) return at(series, index);
  return between(series, index, (change) => change - 2 * Math.PI * Math.round(change / (2 * Math.PI)));
}

function between(series, index, way) {
  const before = Math.floor(index);
  const [start, end] = [series[before], series[(before + 1) % series.length]];
  return start === null || end === null ? start : start + (index - before) * way(end - start);
}

/** A series written out for every position. */
export function full(series, count) {
  return Array.from({ length: count }, (_, index) => at(series, index));
}

/** Magnitude of a vector {x, y} or {x, y, z} of series, for every position; null where any part is. */
export function magnitude(vector, count) {
  const parts = Object.values(vector);
  return Array.from({ length: count }, (_, index) => {
    const values = parts.map((series) => at(series, index));
    return values.includes(null) ? null : Math.hypot(...values);
  });
}

/** Sum of several series, for every position; null where any of them is. */
export function total(list, count) {
  const sum = (index) => list.reduce((all, series) => (all === null || at(series, index) === null ? null : all + at(series, index)), 0);
  return list.every((series) => series?.length === 1) ? Array(count).fill(sum(0)) : Array.from({ length: count }, (_, index) => sum(index));
}

/** Greatest magnitude in any of the series, 0 if there is none. */
export function peak(...list) {
  return list.flat().reduce((most, value) => (Number.isFinite(value) ? Math.max(most, Math.abs(value)) : most), 0);
}

/**
 * The magnitude a view should show: the greatest, unless it is next to a dead centre and towers over all others.
 * Beside it `ease` of the scene is below 1; what grows otherwise than forces do there is a load at work, and all is
 * shown. The rule is that of trunnion/views/curves.py.
 */
export function usualPeak({ ease = [] }, ...list) {
  let [most, rest, works] = [0, 0, 0];
  for (const series of list) {
    series.forEach((value, index) => {
      if (!Number.isFinite(value)) return;
      const share = at(ease, index) ?? 1;
      const size = Math.abs(value);
      most = Math.max(most, size);
      if (share === 1) rest = Math.max(rest, size);
      works = Math.max(works, size * share ** 4);
    });
  }
  return works > 2 * rest || most <= 4 * rest || rest === 0 ? most : 1.25 * rest;
}

/** Least and greatest number in the series, or null. */
export function extent(list) {
  let low = Infinity;
  let high = -Infinity;
  for (const series of list) {
    for (const value of series) {
      if (value === null || !Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  return low <= high ? [low, high] : null;
}

/** The share of the values (0…1) that lies below the answer. */
export function quantile(values, share) {
  const sorted = values.filter((value) => Number.isFinite(value)).sort((a, b) => a - b);
  return sorted.length ? sorted[Math.min(Math.floor(share * sorted.length), sorted.length - 1)] : 0;
}

/** Index of the value nearest to x; over a closed turn the end is as near as the start. */
export function nearest(abscissa, x) {
  let best = 0;
  let least = Infinity;
  abscissa.values.forEach((value, index) => {
    let gap = Math.abs(value - x);
    if (abscissa.closed) gap = Math.min(gap, Math.abs(gap - Math.abs(abscissa.period)));
    if (gap < least) [best, least] = [index, gap];
  });
  return best;
}

/** Ends of the horizontal axis: over a closed turn it runs on to where the turn began. */
export function domain(abscissa) {
  const [low, high] = extent([abscissa.values]) ?? [0, 1];
  if (!abscissa.closed) return low === high ? [low - 0.5, high + 0.5] : [low, high];
  return abscissa.period > 0 ? [low, low + abscissa.period] : [high + abscissa.period, high];
}

/** Where a point is, [x, y] in metres, or null. */
export function place(scene, key, index) {
  const track = scene.points[key];
  if (!track) return null;
  const x = at(track.x, index);
  const y = at(track.y, index);
  return x === null || y === null ? null : [x, y];
}

/** The smallest box around all tracks and pitch circles, {x, y, width, height} in metres; null if nothing was ever
 * assembled. */
export function bounds(scene) {
  const tracks = Object.values(scene.points);
  const reach = (axis) => {
    const rims = scene.gears.map(({ at: key, radius }) => {
      const ends = extent([scene.points[key][axis]]);
      return ends ? [ends[0] - radius, ends[1] + radius] : [];
    });
    return extent([...tracks.map((track) => track[axis]), ...rims]);
  };
  const across = reach("x");
  const up = reach("y");
  if (!across || !up) return null;
  return { x: across[0], y: up[0], width: across[1] - across[0], height: up[1] - up[0] };
}

/** Convex hull of a few points, counter-clockwise (Andrew's monotone chain). */
export function hull(points) {
  const ordered = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  if (ordered.length < 3) return ordered;
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  const half = (list) => {
    const kept = [];
    for (const point of list) {
      while (kept.length > 1 && turn(kept[kept.length - 2], kept[kept.length - 1], point) <= 0) kept.pop();
      kept.push(point);
    }
    return kept.slice(0, -1);
  };
  return [...half(ordered), ...half(ordered.reverse())];
}

/** Whether the position has numbers for everything. */
export function solved(scene, index) {
  return scene.status[index] < FIRST_UNSOLVED;
}

/** The state of a position in a sentence. */
export function state(scene, index) {
  return scene.states[String(scene.status[index])] ?? "not solved";
}

/** The place of a position in words: "132°", "12.5 mm". */
export function say({ abscissa: { values, unit } }, index) {
  return unit === "°" ? `${stated(values[index], "")}°` : stated(values[index], unit);
}

/** Why there is no answer, and over which stretch of the drive. */
export function cause(scene, index) {
  const same = (one) => scene.status[one] === scene.status[index];
  let [first, last] = [index, index];
  while (first > 0 && same(first - 1)) first -= 1;
  while (last < scene.count - 1 && same(last + 1)) last += 1;
  const text = state(scene, index);
  const stretch = first < last ? ` (${say(scene, first)} to ${say(scene, last)})` : "";
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}${stretch}.`;
}

/** Runs [first, last] of positions without an answer. */
export function gaps(scene) {
  return runsWhere(scene, (index) => !solved(scene, index));
}

/** Runs [first, last] of positions that are not valid, for a pin loses contact. */
export function lost(scene) {
  return runsWhere(scene, (index) => scene.status[index] === CONTACT_LOST);
}

function runsWhere(scene, holds) {
  const runs = [];
  for (let index = 0; index < scene.count; index += 1) {
    if (!holds(index)) continue;
    const last = runs[runs.length - 1];
    if (last && last[1] === index - 1) last[1] = index;
    else runs.push([index, index]);
  }
  return runs;
}

/** The force on the second link of a joint at a position, [x, y] N: of a slide with its friction, which acts along it; or null. */
export function forceAt(scene, joint, index) {
  const [x, y] = [at(joint.reaction.x, index), at(joint.reaction.y, index)];
  const along = at(joint.friction, index) ?? 0;
  const angle = along ? guide(scene, joint, index) : 0;
  return x === null || y === null ? null : [x + along * Math.cos(angle), y + along * Math.sin(angle)];
}

/** Direction of a prismatic joint's guide in the global frame, rad. */
export function guide(scene, joint, index) {
  const [x, y] = joint.axis ?? [1, 0];
  const link = scene.links.find((one) => one.name === joint.links[0]);
  return Math.atan2(y, x) + (link ? (angleAt(link.angle, index) ?? 0) : 0);
}
