// The mechanism as SVG: ground, links as bodies, joints, coupler curves, loads, reaction vectors.

import { arrow, longest } from "./arrow.js";
import { leaning, magnified, play, seatOf, told } from "./built.js";
import { at, bounds, cause, guide, hull, magnitude, peak, place, quantile, solved, usualPeak } from "./data.js";
import { html, onWidth, set, svg } from "./dom.js";
import { roundBelow, short, stated } from "./format.js";
import { loadsOf, poseLoad } from "./load.js";
import { poseSlot, slotsOf } from "./slot.js";
import { coil } from "./spring.js";

const MARGIN = 62; // room for labels and arrows, px
const KEY = 30; // height of the strip with the scales, px
const BELOW = 300; // height of what stands below the drawing, so that all of it stays in the window, px

/** The drawing; `show(index)` moves it, `reactions(names, factor)` chooses the vectors and their size. */
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
  const view = {
    scene: magnified(scene, 1),
    built: scene,
    ideal: magnified(scene, 0),
    kinds,
    box,
    stage,
    message,
    index: 0,
    posed: 0,
    factor: 1,
    shown: new Set(scene.joints.map((joint) => joint.name)),
  };
  const forces = scene.joints.map((joint) => magnitude(joint.reaction, scene.count));
  view.peak = usualPeak(scene, ...forces);
  view.towers = view.peak < peak(...forces); // next to a dead centre vectors leave the picture whatever the scale
  view.usual = Math.max(Math.min(quantile(forces.flat(), 0.9), view.peak), view.peak / 2); // long vectors stay in sight, common ones legible
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
    view.fitting = fitting({ ...view, scene: view.built });
    if (view.towers || view.peak * view.fitting > 0.18 * Math.min(width, view.frame.height)) break;
  }
  return view;
}

function build(view) {
  const { scene, frame } = view;
  const apart = scene.factor > 1 ? scene.links.filter((link) => !link.ground) : [];
  view.parts = {
    ideal: apart.map((link) => ({ link, node: svg("path", { class: "ideal" }) })),
    bodies: scene.links.filter((link) => !link.ground).map((link) => body(link, scene)),
    slots: slotsOf(scene, (link) => tint(link, scene)),
    joints: scene.joints.map((one) => joint(one, scene, frame)),
    rails: scene.joints.filter((one) => one.type === "prismatic" && play(scene, one.name)).map(rails),
    points: scene.links
      .filter((link) => !link.ground)
      .flatMap((link) => link.free.map((key) => freePoint(key, link.name))),
    loads: loadsOf(scene),
    springs: scene.springs.map(({ name, ends, pull = [] }) => ({
      ends,
      pull,
      node: svg("path", { class: "spring" }, svg("title", {}, name)),
    })),
    gears: scene.gears.map(({ name, at: key, radius }) => ({
      key,
      radius,
      node: svg("circle", { class: "pitch-circle" }, svg("title", {}, name)),
    })),
    vectors: scene.joints.map((one) => svg("path", { class: `reaction ${view.kinds.get(one.name)}` })),
    drives: scene.drivers.map(() => svg("path", { class: "drive" })),
  };
  view.key = svg("g", { class: "key" });
  view.moving = svg(
    "g",
    {},
    ...view.parts.bodies.map((one) => one.node),
    ...view.parts.slots.map((one) => one.node),
    ...view.parts.ideal.map((one) => one.node),
    ...view.parts.gears.map((one) => one.node),
    ...view.parts.points.map((one) => one.node),
    ...view.parts.rails.map((one) => one.node),
    ...view.parts.joints.map((one) => one.node),
    ...view.parts.springs.map((one) => one.node),
    ...view.parts.drives,
    ...view.parts.loads.map((one) => one.node),
    ...view.parts.vectors,
    ...view.parts.joints.map((one) => one.label),
  );
  view.stage.replaceChildren(
    svg(
      "svg",
      { viewBox: `0 0 ${frame.width} ${Math.round(frame.height)}`, role: "img", "aria-label": `Mechanism: ${scene.name}` },
      ...ground(view),
      ...tracks(view),
      view.moving,
      view.key,
    ),
  );
  scales(view);
  pose(view);
}

/** Pixels a newton at which every usual reaction of the run ends inside the picture, and none hides the mechanism. */
function fitting({ scene, frame, usual, peak: most }) {
  if (!(usual > 0)) return 0;
  const rays = [];
  for (const one of scene.joints) {
    for (let index = 0; index < scene.count; index += 1) {
      const spot = place(scene, one.at, index);
      const [x, y] = [at(one.reaction.x, index), at(one.reaction.y, index)];
      if (spot && x !== null && y !== null && Math.hypot(x, y) <= most) rays.push([...frame.to(spot), x, -y]);
    }
  }
  const room = { left: 6, right: frame.width - 6, top: 6, bottom: frame.height - KEY };
  return Math.min((Math.min(frame.width, frame.height) * 0.24) / usual, longest(rays, room));
}

/** Bearings and guides that stand on the ground; they do not move. */
function ground(view) {
  const { scene, frame } = view;
  const fixed = scene.links.find((link) => link.ground)?.name;
  const still = scene.joints.filter((one) => one.links.includes(fixed));
  return still
    .map((one) => {
      const track = scene.points[one.at];
      const spots = track
        ? Array.from({ length: scene.count }, (_, index) => place(scene, one.at, index)).filter(Boolean)
        : [];
      if (!spots.length) return null;
      const own = scene.built && [one.on, one.at].find((key) => key === `${fixed}.${one.name}`);
      const base = (own && place(scene, own, 0)) || spots[0]; // a pin off the middle of its hole does not move the ground
      if (one.type !== "prismatic") return support(frame, base);
      return rail(frame, base, spots, guide(scene, one, 0), play(scene, one.name) * frame.scale);
    })
    .filter(Boolean);
}

function support(frame, spot) {
  const [x, y] = frame.to(spot);
  return svg(
    "g",
    { class: "ground" },
    svg("path", { class: "bearing", d: `M${x},${y}l-11,19h22Z` }),
    hatching(x, y + 19, 0, 20),
  );
}

/** `apart`: px by which the play widens the guide to either side. */
function rail(frame, base, spots, angle, apart) {
  const [ux, uy] = [Math.cos(angle), Math.sin(angle)];
  const along = spots.map(([x, y]) => x * ux + y * uy);
  const [low, high] = [Math.min(...along), Math.max(...along)];
  const shift = (low + high) / 2 - (base[0] * ux + base[1] * uy);
  const [x, y] = frame.to([base[0] + shift * ux, base[1] + shift * uy]);
  const half = ((high - low) / 2) * frame.scale + 26;
  const gap = 11 + apart;
  return svg("g", { class: "ground" }, hatching(x + gap * uy, y + gap * ux, -angle, half));
}

/** A line with hatching on its far side, around (x, y), turned by `angle` (screen sense, rad). */
function hatching(x, y, angle, half) {
  let path = `M${-half},0H${half}`;
  for (let along = -half + 5; along <= half; along += 6.5) path += `M${along.toFixed(1)},0l-6,7`;
  return svg("path", { class: "hatch", d: path, transform: `translate(${x},${y}) rotate(${(angle * 180) / Math.PI})` });
}

/** Coupler curves of named points, thin ones for moving joints. */
function tracks({ scene, frame }) {
  const parts = [];
  for (const link of scene.links.filter((one) => !one.ground)) {
    for (const key of link.points) {
      const track = scene.points[key];
      if (track.x.length === 1 && track.y.length === 1) continue;
      parts.push(
        svg("path", { class: link.free.includes(key) ? "track free" : "track", d: trackPath(scene, frame, key) }),
      );
    }
  }
  return parts;
}

function trackPath(scene, frame, key) {
  let path = "";
  let pen = "M";
  for (let index = 0; index < scene.count + (scene.abscissa.closed ? 1 : 0); index += 1) {
    const spot = place(scene, key, index % scene.count);
    if (spot) {
      const [x, y] = frame.to(spot);
      path += `${pen}${x.toFixed(1)},${y.toFixed(1)}`;
    }
    pen = spot ? "L" : "M";
  }
  return path;
}

/** The class of the colour that a moving link has. */
function tint(name, scene) {
  return `k${scene.links.filter((one) => !one.ground).findIndex((one) => one.name === name) % 6}`;
}

/** A link as a rounded plate: its outline drawn wide, then less wide in its tint. */
function body(link, scene) {
  const kind = tint(link.name, scene);
  const parts = [
    svg("path", { class: `edge ${kind}` }),
    svg("path", { class: "underlay" }),
    svg("path", { class: `plate ${kind}` }),
  ];
  return { link, parts, node: svg("g", { class: "body" }, svg("title", {}, link.name), ...parts) };
}

/** The symbol of a joint; of one with a seat the hole and, in it, the pin. */
function joint(one, scene, frame) {
  const grounded = scene.links.some((link) => link.ground && one.links.includes(link.name));
  const beside = one.type === "prismatic" ? [26, -13] : grounded ? [-19, 15] : [-11, -10]; // clear of bearing and block
  const node = svg(
    "g",
    { class: "joint" },
    svg("title", {}, one.name),
    one.type === "prismatic"
      ? svg("rect", { ...block(one, scene, frame), y: -10, height: 20, rx: 1.5 })
      : svg("circle", { r: (5 + play(scene, one.name) * frame.scale).toFixed(1) }),
  );
  const pin = one.type !== "prismatic" && play(scene, one.name) ? svg("circle", { class: "pin", r: 5 }) : null;
  if (pin) return { joint: one, pin, beside, label: svg("text", { class: "name" }, short(one.name)), hole: node, node: svg("g", {}, node, svg("g", { class: "joint" }, pin)) };
  return { joint: one, node, beside, label: svg("text", { class: "name" }, short(one.name)) };
}

/** Where a block begins and how long it is: as long as the guide holds it, if that is known, and then seen through. */
function block(one, scene, frame) {
  const length = seatOf(scene.built, one.name)?.length;
  const width = length ? Math.max(length * frame.scale, 8) : 34;
  return { x: (-width / 2).toFixed(1), width: width.toFixed(1), ...(length && { class: "clear" }) };
}

/** The walls of a guide with play. */
function rails(one) {
  return { joint: one, node: svg("path", { class: "rail" }) };
}

function freePoint(key, link) {
  const name = key.slice(link.length + 1);
  return {
    key,
    node: svg("g", { class: "point" }, svg("circle", { r: 3.5 }), svg("text", { x: 9, y: -8 }, short(name))),
  };
}

/** Length bar and reference arrow, with round numbers. */
function scales(view) {
  const { frame, fitting, factor } = view;
  const y = frame.height - 14;
  const length = roundBelow((frame.width * 0.2) / frame.scale);
  const bar = length * frame.scale;
  const parts = [
    svg("path", { class: "bar", d: `M14,${y - 4}v8m0,-4h${bar}m0,-4v8` }),
    svg("text", { x: 14 + bar + 7, y, dy: "0.32em" }, stated(length, "m")),
  ];
  view.perNewton = fitting * factor;
  if (view.perNewton > 0 && view.shown.size) {
    const force = roundBelow((frame.width * 0.17) / view.perNewton);
    const x = frame.width * 0.5;
    parts.push(svg("path", { class: "reaction reference", d: arrow(x, y, force * view.perNewton, 0) }));
    parts.push(svg("text", { x: x + force * view.perNewton + 8, y, dy: "0.32em" }, `reaction ${stated(force, "N")}`));
  }
  if (view.scene.built) {
    const text = `errors × ${told(view.scene.factor)}${view.scene.factor > 1 ? ", ideal dashed" : ""}`;
    parts.push(svg("text", { class: "errors", x: 14, y: 16 }, text));
  }
  view.key.replaceChildren(...parts);
}

/** Everything that moves, at the present position; where it cannot be assembled, the last pose in grey. */
function pose(view) {
  const { scene, frame, index, parts } = view;
  if (!frame) return;
  if (drawable(scene, index)) view.posed = index;
  else if (!drawable(scene, view.posed))
    view.posed = Math.max(
      scene.status.findIndex((_, one) => drawable(scene, one)),
      0,
    );
  const answered = solved(scene, index);
  view.moving.setAttribute("class", answered ? "moving" : "moving without-answer");
  view.message.hidden = answered;
  view.message.textContent = answered ? "" : cause(scene, index);
  parts.ideal.forEach((one) => poseIdeal(view, one));
  parts.bodies.forEach((one) => poseBody(view, one));
  parts.rails.forEach((one) => poseRails(view, one));
  parts.slots.forEach((one) => poseSlot(one, scene, frame, view.posed));
  parts.points.forEach((one) => moveTo(one.node, spotOf(view, one.key)));
  parts.joints.forEach((one) => poseJoint(view, one));
  parts.loads.forEach((one) => {
    one.aim(scene, view.posed);
    poseLoad(one, spotsOf(view, one.keys), frame);
  });
  parts.springs.forEach((one) => {
    const acts = at(one.pull, view.posed) !== 0; // one that acts one way does not everywhere
    set(one.node, { d: coil(spotsOf(view, one.ends)), "stroke-dasharray": acts ? "none" : "2 3" });
  });
  parts.gears.forEach((one) => {
    moveTo(one.node, spotOf(view, one.key));
    set(one.node, { r: one.radius * frame.scale });
  });
  scene.drivers.forEach((driver, order) => poseDrive(view, driver, parts.drives[order]));
  scene.joints.forEach((one, order) => poseVector(view, one, parts.vectors[order]));
}

function drawable(scene, index) {
  return Object.keys(scene.points).every((key) => place(scene, key, index));
}

function spotOf(view, key) {
  const spot = place(view.scene, key, view.posed);
  return spot ? view.frame.to(spot) : null;
}

function spotsOf(view, keys) {
  return keys.map((key) => spotOf(view, key)).filter(Boolean);
}

function moveTo(node, spot, angle = 0) {
  const turn = angle ? ` rotate(${((-angle * 180) / Math.PI).toFixed(2)})` : "";
  set(node, {
    transform: spot ? `translate(${spot[0].toFixed(1)},${spot[1].toFixed(1)})${turn}` : null,
    visibility: spot ? null : "hidden",
  });
}

function poseBody(view, { link, parts }) {
  const path = closedPath(spotsOf(view, link.points));
  parts.forEach((part) => part.setAttribute("d", path));
}

/** The hull of some spots as a path. */
function closedPath(spots) {
  const corners = hull(spots).map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`);
  return corners.length ? `M${corners.join("L")}${corners.length > 2 ? "Z" : ""}` : "";
}

/** The outline of a link where the ideal mechanism has it. */
function poseIdeal({ ideal, frame, posed }, { link, node }) {
  const spots = link.points.map((key) => place(ideal, key, posed)).filter(Boolean);
  node.setAttribute("d", closedPath(spots.map(frame.to)));
}

/** Both walls of a guide, as far apart as the block is high and the play wide. */
function poseRails({ scene, frame, posed }, { joint: one, node }) {
  const [on, at_] = [place(scene, one.on, posed), place(scene, one.at, posed)];
  if (!on || !at_) return set(node, { d: "" });
  const angle = guide(scene, one, posed);
  const [ux, uy] = [Math.cos(angle), -Math.sin(angle)];
  const along = ((at_[0] - on[0]) * Math.cos(angle) + (at_[1] - on[1]) * Math.sin(angle)) * frame.scale;
  const half = Math.max(((seatOf(scene.built, one.name)?.length ?? 0) / 2) * frame.scale, 17) + 14;
  const gap = 10 + play(scene, one.name) * frame.scale;
  const [x, y] = frame.to(on);
  const wall = (side) => {
    const end = (far) => `${(x + far * ux - side * uy).toFixed(1)},${(y + far * uy + side * ux).toFixed(1)}`;
    return `M${end(along - half)}L${end(along + half)}`;
  };
  return set(node, { d: wall(gap) + wall(-gap) });
}

function poseJoint(view, one) {
  const spot = spotOf(view, one.joint.at);
  const slides = one.joint.type === "prismatic";
  const angle = slides ? guide(view.scene, one.joint, view.posed) + leaning(view.scene, one.joint, view.posed) : 0;
  moveTo(one.hole ?? one.node, spot, angle);
  if (one.pin) moveTo(one.pin, spotOf(view, one.joint.on));
  moveTo(one.label, spot && [spot[0] + one.beside[0], spot[1] + one.beside[1]]);
}

/** An arc around a turning drive in the sense it turns; along its way, for a sliding one an arrow. */
function poseDrive(view, driver, node) {
  const one = view.scene.joints.find((candidate) => candidate.name === driver.name);
  const spot = one ? spotOf(view, one.at) : null;
  const { values, period } = view.scene.abscissa;
  const forward =
    view.scene.drivers.indexOf(driver) > 0 ? 0 : Math.sign(period || values[values.length - 1] - values[0]);
  if (!spot || !forward) return set(node, { d: "" });
  const [x, y] = spot;
  if (driver.type === "prismatic") {
    const angle = guide(view.scene, one, view.posed);
    return set(node, {
      d: arrow(
        x - 30 * Math.sin(angle),
        y - 30 * Math.cos(angle),
        34 * forward * Math.cos(angle),
        -34 * forward * Math.sin(angle),
      ),
    });
  }
  const end = forward > 0 ? -1 : 1; // counter-clockwise ends on the left
  const tip = [x + end * 19, y - 15];
  const head = `m${-end * 1.2},-8.2L${tip}l${-end * 8.2},-1.2`;
  return set(node, { d: `M${x - end * 19},${y - 15}A24.2,24.2 0 0 ${forward > 0 ? 0 : 1} ${tip}${head}` });
}

function poseVector(view, one, node) {
  const spot = spotOf(view, one.at);
  const x = at(one.reaction.x, view.index);
  const y = at(one.reaction.y, view.index);
  const show = spot && view.shown.has(one.name) && x !== null && y !== null;
  node.setAttribute("d", show ? arrow(spot[0], spot[1], x * view.perNewton, -y * view.perNewton) : "");
}
