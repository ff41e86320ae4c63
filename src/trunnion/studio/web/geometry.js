// Arithmetic of the drawing: grid, snapping, lengths, the scene of a mechanism that has no answer yet. No drawing here.

import { bounds, place } from "../web/data.js";

const FINE = 13; // px, the least distance of grid lines
const NEAR = 16; // px within which a point is taken

/** The round number at or above `value`: 1, 2 or 5 times a power of ten. */
export function roundAbove(value) {
  const base = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((one) => one * base).find((one) => one >= value * (1 - 1e-9));
}

/** Distance of grid lines, m, at so many pixels a metre. */
export function gridStep(scale) {
  return roundAbove(FINE / scale);
}

/** A number on the grid of a step, without the noise of binary fractions. */
export function onGrid(value, step) {
  return Number((Math.round(value / step) * step).toPrecision(12));
}

/** What a pointer at `at` m takes: a joint or point near it, else a place on the grid. `near` and `step` in m. */
export function snap(spots, at, { near, step }) {
  let best = null;
  let least = near;
  for (const one of spots) {
    const far = Math.hypot(one.at[0] - at[0], one.at[1] - at[1]);
    if (far < least) [best, least] = [one, far];
  }
  return best ?? { kind: null, at: at.map((value) => onGrid(value, step)) };
}

/** The place on a line through two of some spots that is nearest to a place within their reach; the place itself beyond `near`. */
export function onLine(spots, at, near) {
  let [best, least] = [at, near];
  spots.forEach((a, order) =>
    spots.slice(order + 1).forEach((b) => {
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const square = dx * dx + dy * dy;
      if (square === 0) return;
      const share = Math.min(Math.max(((at[0] - a[0]) * dx + (at[1] - a[1]) * dy) / square, 0), 1);
      const foot = [a[0] + share * dx, a[1] + share * dy];
      const far = Math.hypot(foot[0] - at[0], foot[1] - at[1]);
      if (far < least) [best, least] = [foot.map((value) => Number(value.toPrecision(12))), far];
    }),
  );
  return best;
}

/** Where the lines through two points each of `first` and of `second` cross nearest to a place, within `near`; the place itself if none do. */
export function crossing(first, second, at, near) {
  let [best, least] = [at, near];
  const lines = (spots) => spots.flatMap((a, order) => spots.slice(order + 1).map((b) => [a, [b[0] - a[0], b[1] - a[1]]]));
  for (const [[x, y], [u, v]] of lines(first))
    for (const [[a, b], [p, q]] of lines(second)) {
      const by = u * q - v * p;
      if (Math.abs(by) <= 1e-9 * Math.hypot(u, v) * Math.hypot(p, q)) continue; // they are parallel
      const share = ((a - x) * q - (b - y) * p) / by;
      const meet = [x + share * u, y + share * v];
      const far = Math.hypot(meet[0] - at[0], meet[1] - at[1]);
      if (far < least) [best, least] = [meet.map((value) => Number(value.toPrecision(12))), far];
    }
  return best;
}

/** The name of a file for a model: that of its own file, or of the model without what file names lack. */
export function stemOf(entries, file = null) {
  if (file) return file.replace(/\.[^.]+$/, "");
  const name = String(entries?.name ?? "").replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, ""); // prettier-ignore
  return name.slice(0, 60) || "mechanism";
}

export const nearOf = (scale) => NEAR / scale;

/** Joints, then points that are no joints, with their places: [{kind, name, key, at}]. */
export function spotsOf(scene, index) {
  const spot = (key) => place(scene, key, index);
  const joints = scene.joints.map(({ name, at, on }) => ({ kind: "joints", name, key: at, at: spot(at) ?? spot(on) }));
  const free = scene.links.flatMap((link) =>
    link.free.map((key) => ({ kind: "points", name: key, key, at: spot(key), link: link.name })),
  );
  return [...joints, ...free].filter((one) => one.at);
}

/** Whether the mechanism can be drawn at any position. */
export function assembled(scene) {
  const posed = posedAt(scene, 0);
  return Object.keys(scene.points).every((key) => place(scene, key, posed));
}

/** The position nearest to `index` at which all points have a place: where the mechanism can be drawn. */
export function posedAt(scene, index) {
  const tracks = Object.keys(scene.points);
  const drawable = (one) => one >= 0 && one < scene.count && tracks.every((key) => place(scene, key, one));
  if (!tracks.length) return index;
  for (let far = 0; far < scene.count; far += 1) {
    if (drawable(index - far)) return index - far;
    if (drawable(index + far)) return index + far;
  }
  return index;
}

/** The places of all points at a position, {"link.point": [x, y]}. */
export function placesAt(scene, index) {
  const known = Object.keys(scene.points).map((key) => [key, place(scene, key, index)]);
  return Object.fromEntries(known.filter(([, at]) => at));
}

/** A scene of one position made of what is written and where it was drawn: the same shape as one with an answer. */
export function sketch(entries, places, numbers = {}) {
  const links = Object.entries(dictionary(entries?.links));
  const joints = Object.entries(dictionary(entries?.joints)).filter(([, one]) => Array.isArray(one?.links));
  const ground = groundOf(entries);
  const points = Object.fromEntries(Object.entries(places).map(([key, [x, y]]) => [key, { x: [x], y: [y] }]));
  const angles = Object.fromEntries(links.map(([name, link]) => [name, angleOf(name, link, places, numbers)]));
  for (const { type, links: pair } of joints.map(([, one]) => one)) // a block lies along its guide
    if (type === "prismatic") angles[pair[1]] ??= angles[pair[0]];
  const rows = links.map(([name, link]) => {
    const keys = Object.keys(dictionary(link?.points)).map((point) => `${name}.${point}`);
    const known = keys.filter((key) => key in points);
    const free = known.filter((key) => !joints.some(([joint]) => key === `${name}.${joint}`));
    return { name, ground: name === ground, points: known, free, angle: [name === ground ? 0 : (angles[name] ?? 0)] };
  });
  return {
    name: String(entries?.name ?? ""),
    count: 1,
    abscissa: { label: "", unit: "", closed: false, period: 0, values: [0] },
    status: [0],
    states: {},
    ease: [1],
    points,
    links: rows,
    joints: joints.map(([name, one]) => jointOf(name, one, entries)).filter(({ at, on }) => at in points || on in points),
    loads: loadsOf(entries, numbers, points),
    springs: Object.entries(dictionary(entries?.springs))
      .map(([name, one]) => ({ name, ends: one?.between ?? [] }))
      .filter(({ ends }) => ends.length === 2 && ends.every((key) => key in points)),
    gears: gearsOf(entries, numbers, places),
    drivers: Object.keys(dictionary(entries?.drivers)).map((name) => ({
      name,
      type: entries.joints?.[name]?.type ?? "revolute",
    })),
    sums: {},
    built: null,
  };
}

/** The name of the ground as the file says it, or the usual ones. */
export function groundOf(entries) {
  const links = dictionary(entries?.links);
  return entries?.ground ?? ["ground", "frame"].find((name) => name in links) ?? Object.keys(links)[0];
}

/** A part of the file if it is a group of named things, else nothing. */
export function dictionary(part) {
  return part !== null && typeof part === "object" && !Array.isArray(part) ? part : {};
}

function jointOf(name, { type, links: [first, second] }, entries) {
  const seat = entries.links?.[first]?.points?.[name]?.axis;
  const axis = Array.isArray(seat) && seat.every((part) => Number.isFinite(Number(part))) ? seat.map(Number) : [1, 0];
  const reaction = { x: [null], y: [null] };
  return { name, type: type ?? "revolute", links: [first, second], axis, at: `${second}.${name}`, on: `${first}.${name}`, reaction };
}

/** How far a link is turned from its own frame, rad, by two of its points; null of a block, whose points are one. */
function angleOf(name, link, places, numbers) {
  const spots = Object.keys(dictionary(link?.points)).flatMap((point) => {
    const own = ["x", "y"].map((axis) => numbers[`links.${name}.points.${point}.${axis}`] ?? 0);
    return places[`${name}.${point}`] ? [{ own, at: places[`${name}.${point}`] }] : [];
  });
  const other = spots.find(({ own }) => Math.hypot(own[0] - spots[0].own[0], own[1] - spots[0].own[1]) > 0);
  if (!other) return null;
  const turn = (key) => Math.atan2(other[key][1] - spots[0][key][1], other[key][0] - spots[0][key][0]);
  return turn("at") - turn("own");
}

/** Pitch circles of gear pairs on one carrier: |r₁|/|r₂| is the ratio, and r₁ + r₂ (or their difference) the distance; of
 * a rack, chain or rope that of its wheel. */
function gearsOf(entries, numbers, places) {
  return Object.entries(dictionary(entries?.gears)).flatMap(([name, gear]) => {
    const pair = (Array.isArray(gear?.joints) ? gear.joints : []).map((joint) => `${entries.joints?.[joint]?.links?.[1]}.${joint}`);
    const [ratio, radius] = ["ratio", "radius"].map((key) => numbers[`gears.${name}.${key}`]);
    const wheel = pair.find((key, order) => entries.joints?.[gear.joints[order]]?.type !== "prismatic" && places[key]);
    if (radius && wheel) return [{ name, at: wheel, radius: Math.abs(radius) }];
    const [one, two] = pair.map((key) => places[key]);
    if (!one || !two || !ratio || ratio === 1) return [];
    const far = Math.hypot(two[0] - one[0], two[1] - one[1]);
    return [Math.abs(ratio / (ratio - 1)), Math.abs(1 / (ratio - 1))].map((share, order) => ({ name, at: pair[order], radius: share * far }));
  });
}

function loadsOf(entries, numbers, points) {
  return Object.entries(dictionary(entries?.loads))
    .map(([name, load]) => ({
      name,
      link: load?.link,
      at: `${load?.link}.${load?.at}` in points ? `${load.link}.${load.at}` : null,
      force: ["x", "y"].map((axis) => numbers[`loads.${name}.force.${axis}`] ?? 0),
      moment: numbers[`loads.${name}.moment`] ?? 0,
      frame: "global",
      varies: false,
    }))
    .filter(({ at, link }) => at && entries.links?.[link]);
}

/** The box that a view should show, {x, y, width, height} in m; null if there is nothing. */
export function extentOf(scene) {
  return Object.keys(scene.points).length ? bounds(scene) : null;
}

const UNITS = { "": null, mm: 1e-3, cm: 1e-2, dm: 0.1, m: 1, km: 1e3, in: 0.0254, ft: 0.3048, um: 1e-6, µm: 1e-6 };

/** A typed length in m ("60", "60 mm", "2.5in"); a bare number is in `unit`. Null if it is none, or may be a thousand. */
export function lengthOf(typed, unit) {
  const found = /^\s*(?!\d+,\d{3}(?!\d))(\d*[.,]?\d+|\d+[.,])\s*([a-zµ]*)\s*$/i.exec(typed);
  if (!found || !(found[2] in UNITS)) return null;
  const value = Number(found[1].replace(",", ".")) * (UNITS[found[2]] ?? UNITS[unit]);
  return value > 0 ? value : null;
}

/** The unit that lengths are typed and told in when the window is so many metres wide. */
export function lengthUnit(width) {
  return width > 4 ? "m" : "mm";
}

/** A length of m as text with its unit, with no more digits than a step asks for. */
export function lengthText(value, unit, step) {
  const decimals = Math.min(Math.max(-Math.floor(Math.log10(step / UNITS[unit]) + 1e-9), 0), 9);
  return `${(value / UNITS[unit]).toFixed(decimals)} ${unit}`;
}
