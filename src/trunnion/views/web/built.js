// A scene with its errors magnified: links at their ideal pose and `factor` times the difference. 1 is as built, 0 ideal.

import { angleAt, at, full, place } from "./data.js";
import { apply, cross, plus, rotation, scaled } from "./vector.js";

/** The scene as it is drawn with errors `factor` times as large; the same scene where it has none, or at 1. */
export function magnified(scene, factor) {
  if (!scene.built || factor === 1) return { ...scene, factor };
  return scene.space === "spatial" ? inSpace(scene, factor) : inPlane(scene, factor);
}

/** Sum of two series, the second times a factor, for every position; null where either is. */
function moved(one, other, factor, count) {
  const [a, b] = [full(one, count), full(other, count)];
  return a.map((value, index) => (value === null || b[index] === null ? null : value + factor * b[index]));
}

function inPlane(scene, factor) {
  const { built, count } = scene;
  const points = Object.fromEntries(
    Object.entries(scene.points).map(([key, track]) => {
      const error = built.points[key];
      const axes = error ? ["x", "y"].map((axis) => [axis, moved(track[axis], error[axis], factor - 1, count)]) : [];
      return [key, error && !still(error) ? Object.fromEntries(axes) : track];
    }),
  );
  const links = scene.links.map((link) => {
    const error = built.links[link.name];
    return error && !link.ground ? { ...link, angle: moved(link.angle, error, factor - 1, count) } : link;
  });
  return { ...scene, points, links, factor };
}

function still({ x, y }) {
  return [x, y].every((series) => series.length === 1 && series[0] === 0);
}

/** How much more the second link of a joint is turned against the first than in the ideal mechanism, rad, magnified. */
export function leaning({ built, factor = 1 }, joint, index) {
  const [first, second] = joint.links.map((name) => at(built?.links[name], index) ?? 0);
  return factor * (second - first);
}

/** The play of a joint as it is drawn, metres; 0 where its pin has no seat. */
export function play({ built, factor = 1 }, name) {
  return factor * (seatOf(built, name)?.clearance ?? 0);
}

/** The middle of the hole of a pin in the plane, [x, y] in metres as it is drawn: beside its point where it is bored off; null where that is not told. */
export function hole(scene, joint, index) {
  const { built, factor = 1 } = scene;
  const [pin, end] = [place(scene, joint.on, index), seatOf(built, joint.name)?.ends[0]];
  const [x, y] = end ? [at(end.offset.x, index), at(end.offset.y, index)] : [null, null];
  if (!pin || x === null || y === null) return null;
  const link = scene.links.find(({ name }) => name === joint.links[1]);
  const angle = (angleAt(link?.angle, index) ?? 0) - (factor - 1) * (at(built.links[link?.name], index) ?? 0); // no offset is turned by errors
  const [c, s] = [factor * Math.cos(angle), factor * Math.sin(angle)];
  return [pin[0] - c * x + s * y, pin[1] - s * x - c * y];
}

/** The seat of a joint, or undefined. */
export function seatOf(built, name) {
  return built?.seats.find((one) => one.joint === name);
}

function inSpace(scene, factor) {
  const by = (link, point) => stretched(scene.built.links[link], point, factor - 1);
  const links = scene.links.map((link) => {
    const error = scene.built.links[link.name];
    return error && link.pose ? { ...link, pose: posed(scene, link.pose, error, factor - 1) } : link;
  });
  const solids = scene.solids.map((solid) => ({
    ...solid,
    points: solid.kind === "box" ? [by(solid.link, solid.points[0]), ...solid.points.slice(1)] : solid.points.map((point) => by(solid.link, point)),
  }));
  const seats = Object.fromEntries(
    Object.entries(scene.seats).map(([name, one]) => [name, { ...one, at: by(one.link, one.at) }]),
  );
  const free = scene.free.map((point) => ({ ...point, at: by(point.link, point.at) }));
  const loads = scene.loads.map((load) => ({ ...load, at: by(load.link, load.at) }));
  return { ...scene, links, solids, seats, free, loads, factor };
}

/** A point of a link moved by what is told of its joints: by that of the nearest most. */
export function stretched(error, point, factor) {
  const rows = error?.stretch ?? [];
  let [sum, total] = [[0, 0, 0], 0];
  for (const { at: place, by } of rows) {
    const square = plus(point, place, -1).reduce((all, part) => all + part * part, 0);
    if (square === 0) return plus(point, by, factor);
    sum = plus(sum, by, 1 / square);
    total += 1 / square;
  }
  return total ? plus(point, sum, factor / total) : point;
}

/** The pose of a link moved by `factor` times its shift and turned about its middle by `factor` times its turn. */
function posed(scene, pose, { about, shift, turn }, factor) {
  const made = Object.fromEntries([..."xyzwijk"].map((name) => [name, []]));
  for (let index = 0; index < scene.count; index += 1) {
    const old = Object.fromEntries([..."xyzwijk"].map((name) => [name, at(pose[name], index)]));
    const [by, round] = [shift, turn].map(({ x, y, z }) => [at(x, index), at(y, index), at(z, index)]);
    const known = ![...Object.values(old), ...by, ...round].includes(null);
    const now = known ? movedBy(old, about, scaled(by, factor), scaled(round, factor)) : {};
    for (const name of Object.keys(made)) made[name].push(known ? now[name] : null);
  }
  return made;
}

/** A pose {x, y, z, w, i, j, k} shifted and turned by a rotation vector about a point of the link. */
export function movedBy(old, about, shift, round) {
  const angle = Math.hypot(...round);
  const [w, share] = [Math.cos(angle / 2), angle > 0 ? Math.sin(angle / 2) / angle : 0.5];
  const v = scaled(round, share);
  const was = [old.i, old.j, old.k];
  const turned = plus(plus(scaled(was, w), v, old.w), cross(v, was));
  const quaternion = { w: w * old.w - v[0] * was[0] - v[1] * was[1] - v[2] * was[2], i: turned[0], j: turned[1], k: turned[2] };
  const middle = plus([old.x, old.y, old.z], apply(rotation(old), about)); // it only shifts
  const [x, y, z] = plus(plus(middle, shift), apply(rotation(quaternion), about), -1);
  return { x, y, z, ...quaternion };
}

/** Whether the way from one place to the next, px, is a jump of a pin whose play is `rho` px. */
export function jumpsAt(last, spot, rho) {
  return !last || Math.hypot(spot[0] - last[0], spot[1] - last[1]) > rho;
}

const LONGEST = 3; // powers of ten that the slider spans

/** A number with a few digits and no zeros behind: "1", "200". */
export function told(value, digits = 2) {
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

/** The slider and the two buttons for the magnification of the errors; `apply(factor)` is told of a change. */
export function magnifier({ preset }, html, change) {
  const slider = html("input", { type: "range", min: 0, max: LONGEST, step: 0.01, value: 0, class: "magnification", "aria-label": "Magnification of the errors, logarithmic" });
  const output = html("output", { class: "factor" }, "× 1");
  const choose = (factor) => {
    slider.value = String(Math.log10(factor));
    show(factor);
  };
  const show = (factor) => {
    const round = Number(factor.toPrecision(2));
    output.textContent = `× ${told(factor)}`;
    slider.setAttribute("aria-valuetext", `errors ${told(factor)} times as large`);
    change(round);
  };
  slider.addEventListener("input", () => show(10 ** Number(slider.value)));
  const buttons = [...new Set([1, preset])].map((factor) => {
    const button = html("button", { type: "button", class: "plain" }, `× ${told(factor)}`);
    button.addEventListener("click", () => choose(factor));
    return button;
  });
  return html("fieldset", { class: "vectors" }, html("legend", {}, "Errors magnified"), slider, output, ...buttons);
}
