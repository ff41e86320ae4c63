// The mechanism of a report: the whole motion in one frame, the errors of one as built magnified beside the ideal one.

import { arrow, longest } from "./arrow.js";
import { magnified, seatOf, told } from "./built.js";
import { bounds, cause, guide, place, solved } from "./data.js";
import { html, onWidth, set, svg } from "./dom.js";
import { roundBelow, stated } from "./format.js";
import { forcesOf, outline, partsOf, poseParts, sizesOf, standing, tracksOf } from "./plane.js";

const MARGIN = 62; // room for labels and arrows, px
const KEY = 30; // height of the strip with the scales, px
const BELOW = 300; // height of what stands below the drawing, so that all of it stays in the window, px

/** The drawing; `show(index)` moves it, `reactions(names, factor)` chooses the vectors and the size of all forces. */
export function mechanismView(scene, kinds) {
  const stage = html("div", { class: "stage" });
  const message = html("p", { class: "message", hidden: true });
  const element = html("div", { class: "mechanism" }, stage, message);
  const box = surround(scene, 1);
  if (!box) {
    message.textContent = "The mechanism could not be assembled at any position.";
    message.hidden = false;
    element.classList.add("empty");
    return { element, show() {}, reactions() {}, magnify() {} };
  }
  const forces = forcesOf(scene);
  const view = {
    scene: magnified(scene, 1),
    ideal: magnified(scene, 0),
    kinds,
    box,
    stage,
    message,
    forces,
    sizes: sizesOf(scene, forces),
    index: 0,
    posed: 0,
    factor: 1,
    shown: new Set(scene.joints.map((joint) => joint.name)),
  };
  onWidth(stage, (width) => build(fit(view, width)), 490);
  return {
    element,
    magnify(factor) {
      view.scene = magnified(scene, factor);
      view.box = surround(scene, factor);
      if (view.frame) build(fit(view, view.frame.width));
    },
    show(index) {
      view.index = index;
      pose(view);
    },
    reactions(names, factor) {
      view.shown = new Set(names);
      view.factor = factor;
      if (view.frame) scales(view);
      pose(view);
    },
  };
}

/** The box around the whole motion with its errors `factor` times as large, its blocks with their walls, and the ideal
 * mechanism beside it; null if nothing was ever assembled. */
function surround(scene, factor) {
  const drawn = magnified(scene, factor);
  const shown = factor > 1 ? [drawn, magnified(scene, 0)] : [drawn];
  const boxes = shown.map(bounds);
  if (boxes.includes(null)) return null;
  let [left, low, right, high] = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (x0, y0, x1, y1) => {
    [left, low, right, high] = [Math.min(left, x0), Math.min(low, y0), Math.max(right, x1), Math.max(high, y1)];
  };
  for (const { x, y, width, height } of boxes) add(x, y, x + width, y + height);
  for (const one of drawn.joints.filter(({ type }) => type === "prismatic")) {
    const half = (seatOf(drawn.built, one.name)?.length ?? 0) / 2;
    for (let index = 0; half && index < drawn.count; index += 1) {
      const spot = place(drawn, one.at, index);
      const angle = spot ? guide(drawn, one, index) : null;
      if (angle === null) continue;
      const [x, y] = [Math.abs(half * Math.cos(angle)), Math.abs(half * Math.sin(angle))];
      add(spot[0] - x, spot[1] - y, spot[0] + x, spot[1] + y);
    }
  }
  return { x: left, y: low, width: right - left, height: high - low };
}

/** Where the mechanism lies in the picture; `margin` px around it are for labels and arrows. */
function framed({ box }, width, margin) {
  const tall = Math.min(
    Math.max(((width - 2 * margin) * box.height) / (box.width || 1) + 2 * margin, width * 0.5),
    width * 0.95,
    window.innerWidth > 900 ? Math.max(window.innerHeight - BELOW, 250) : 620,
    620,
  );
  const scale = Math.min((width - 2 * margin) / (box.width || 1e-9), (tall - 2 * margin) / (box.height || 1e-9));
  const left = (width - scale * box.width) / 2 - scale * box.x;
  const foot = (tall + scale * box.height) / 2 + scale * box.y;
  return { width, height: tall, scale, to: ([x, y]) => [left + scale * x, foot - scale * y] };
}

/** Choose frame and scale of the vectors: the margin grows until the longest vector is well seen. */
function fit(view, width) {
  for (const growth of [1, 1.3, 1.6]) {
    view.frame = framed(view, width, growth * Math.min(MARGIN, width * 0.12));
    view.fitting = fitting(view);
    if (view.sizes.beyond || view.sizes.most * view.fitting > 0.18 * Math.min(width, view.frame.height)) break;
  }
  return view;
}

/** Pixels a newton at which every usual force of the run ends inside the picture, and none hides the mechanism. */
function fitting({ scene, frame, forces, sizes: { usual, most } }) {
  if (!(usual > 0)) return 0;
  const rays = [];
  for (const { keys, at: force } of forces) {
    for (let index = 0; index < scene.count; index += 1) {
      const spots = keys.map((key) => place(scene, key, index)).filter(Boolean);
      const [x, y] = force(index) ?? [Infinity, 0];
      if (spots.length && Math.hypot(x, y) <= most) rays.push([...frame.to(spots[0]), x, -y]);
    }
  }
  const room = { left: 6, right: frame.width - 6, top: 6, bottom: frame.height - KEY };
  return Math.min((Math.min(frame.width, frame.height) * 0.24) / usual, longest(rays, room));
}

function build(view) {
  const { scene, frame, kinds } = view;
  view.parts = partsOf(scene, kinds);
  const apart = scene.factor > 1 ? scene.links.filter((link) => !link.ground) : [];
  view.outlines = apart.map((link) => ({ link, node: svg("path", { class: "ideal" }) }));
  view.key = svg("g", { class: "key" });
  const nodes = (...names) => names.flatMap((name) => view.parts[name].map((one) => one.node));
  view.moving = svg(
    "g",
    {},
    ...nodes("bodies", "slots", "cylinders"),
    ...view.outlines.map((one) => one.node),
    ...nodes("gears", "points", "walls", "joints", "springs", "drives", "loads", "vectors", "names"),
  );
  const px = (spot) => frame.to(spot).map((one) => one.toFixed(1));
  view.stage.replaceChildren(
    svg(
      "svg",
      { viewBox: `0 0 ${frame.width} ${Math.round(frame.height)}`, role: "img", "aria-label": `Mechanism: ${scene.name}` },
      ...nodes("supports", "guides"),
      ...tracksOf(scene, px),
      view.moving,
      view.key,
    ),
  );
  scales(view);
  pose(view);
}

/** Length bar and reference arrow, with round numbers. */
function scales(view) {
  const { frame, fitting: usual, factor } = view;
  const y = frame.height - 14;
  const length = roundBelow((frame.width * 0.2) / frame.scale);
  const bar = length * frame.scale;
  const parts = [
    svg("path", { class: "bar", d: `M14,${y - 4}v8m0,-4h${bar}m0,-4v8` }),
    svg("text", { x: 14 + bar + 7, y, dy: "0.32em" }, stated(length, "m")),
  ];
  view.perNewton = usual * factor;
  if (view.perNewton > 0 && (view.shown.size || view.parts.loads.some((one) => one.force))) {
    const force = roundBelow((frame.width * 0.17) / view.perNewton);
    const x = frame.width * 0.5;
    parts.push(svg("path", { class: "reaction reference", d: arrow(x, y, force * view.perNewton, 0) }));
    parts.push(svg("text", { x: x + force * view.perNewton + 8, y, dy: "0.32em" }, `force ${stated(force, "N")}`));
  }
  if (view.scene.built) {
    const text = `errors × ${told(view.scene.factor)}${view.scene.factor > 1 ? ", ideal dashed" : ""}`;
    parts.push(svg("text", { class: "errors", x: 14, y: 16 }, text));
  }
  view.key.replaceChildren(...parts);
}

/** Everything that moves, at the present position; where it cannot be assembled, the last pose in grey. */
function pose(view) {
  const { scene, ideal, frame, index, shown, perNewton } = view;
  if (!frame) return;
  const drawable = (one) => Object.keys(scene.points).every((key) => place(scene, key, one));
  if (drawable(index)) view.posed = index;
  else if (!drawable(view.posed)) view.posed = Math.max(scene.status.findIndex((_, one) => drawable(one)), 0);
  const answered = solved(scene, index);
  view.moving.setAttribute("class", answered ? "moving" : "moving without-answer");
  view.message.hidden = answered;
  view.message.textContent = answered ? "" : cause(scene, index);
  const more = { perNewton, force: index, shown: (name) => shown.has(name), named: true, forward: 0, room: frame };
  poseParts(view.parts, standing(scene, frame, view.posed, more));
  const there = standing(ideal, frame, view.posed, {});
  view.outlines.forEach(({ link, node }) => set(node, { d: outline(there.spots(link.points)) }));
}
