// A mechanism in space: what is chosen is lit; joints and points are moved in the plane of the picture or along an axis.

import { effect, untracked } from "@preact/signals";
import { useEffect, useRef, useState } from "preact/hooks";
import { arrow } from "../web/arrow.js";
import { set, svg } from "../web/dom.js";
import { stated } from "../web/format.js";
import { linkAt, placed, seat, spaceView, spot } from "../web/space.js";
import { changed, edit, newest } from "./actions.js";
import { plainNumber, usualUnit } from "./fields.js";
import { dictionary, gridStep, lengthOf, lengthText, onGrid } from "./geometry.js";
import { cornered, kindsOf, partUnder, sheet } from "./sheet.js";
import * as state from "./state.js";
import { theme } from "./theme.js";
import { Button, focusOn, html } from "./ui.js";

const STILL = 3; // px that a click may move
const TARGET = 12; // radius of what a hand takes hold of, px
const [ARM, LEAST] = [62, 12]; // px, of the arrows of a joint that is moved, and of those that are too short to be taken
const AXES = ["x", "y", "z"];

/** The drawing and what is dragged: {api, sheet, held}. */
const stage = { api: null, held: null, sheet: 0 };

export function Space() {
  const holder = useRef(null);
  useEffect(() => mount(holder.current), []);
  return html`<div class="in-space"><div class="picture" ref=${holder}></div><${Mover} /></div>`;
}

function mount(holder) {
  const hands = svg("svg", { class: "hands" });
  const layers = { hands, rubber: svg("g", {}), targets: svg("g", {}), arms: svg("g", {}) };
  hands.append(layers.rubber, layers.targets, layers.arms);
  const stop = [
    effect(() => {
      const scene = cornered.value?.scene ?? state.live.value?.scene ?? state.answer.value?.scene;
      untracked(() => {
        draw(holder, scene?.space === "spatial" ? scene : null, layers);
        if (cornered.peek()) stage.api?.reactions([], 1); // only its places are known
      });
    }),
    effect(() => {
      theme.value;
      untracked(() => stage.api?.recolour());
    }),
    effect(() => {
      const factor = state.factor.value;
      untracked(() => stage.api?.magnify(factor));
    }),
    effect(() => {
      state.answer.value;
      cornered.value;
      state.live.value;
      stage.api?.show(state.index.value);
    }),
    effect(() => {
      const chosen = state.selection.value;
      if (!stage.api) return;
      stage.api.view.chosen = chosen;
      untracked(() => stage.api.show(state.index.value));
    }),
  ];
  return () => {
    stop.forEach((end) => end());
    stage.api = null;
    sheet.finest = 0;
  };
}

/** Draw a scene, from where the last of the same sheet was looked at. */
function draw(holder, scene, layers) {
  const other = stage.sheet !== state.opened.value;
  if (!scene && (other || !holder.firstChild)) return holder.replaceChildren(message(state.answer.value));
  stage.api?.element.classList.toggle("without-answer", !scene);
  if (!scene) return;
  stage.sheet = state.opened.value;
  const kinds = kindsOf(scene);
  if (!scene.solids.length) return holder.replaceChildren(spaceView(scene, kinds).element);
  const shown = stage.api;
  if (!shown) {
    stage.api = spaceView(scene, kinds, { fill: true, after: (view) => pose(view, layers) });
    stage.api.view.chosen = state.selection.value;
    stage.api.view.stage.append(layers.hands);
    listen(stage.api.view.stage);
  }
  if (stage.api.element.parentNode !== holder) holder.replaceChildren(stage.api.element, stage.api.controls);
  shown?.take(scene, kinds, other);
}

function message(answer) {
  const words = answer?.entries ? "The mechanism appears as soon as its parts fit together." : "";
  return Object.assign(document.createElement("p"), { className: "calm", textContent: words });
}

// ---- choosing

/** What can be chosen in the picture: joints, points and links, [{kind, name, at}], m. */
function partsOf({ scene, links, posed, tracks }) {
  const joints = scene.joints.map(({ name }) => ({ kind: "joints", name, at: seat({ scene, links }, name, posed) }));
  const points = tracks.map(({ point }) => ({ kind: "points", name: point.key, at: placed({ links }, point.link, point.at, posed) }));
  const bodies = scene.links.map(({ name }) => {
    const own = scene.joints.filter((joint) => joint.links.includes(name)).map((joint) => joints.find((one) => one.name === joint.name).at);
    const known = own.filter(Boolean);
    return { kind: "links", name, at: known.length ? AXES.map((_, axis) => known.reduce((sum, at) => sum + at[axis], 0) / known.length) : null };
  });
  return [...joints, ...points, ...bodies].filter(({ at }) => at);
}

/** Put the targets over the drawing, and the arrows of what is chosen. */
function pose(view, layers) {
  const { frame, project } = view;
  const parts = partsOf(view);
  sheet.finest = gridStep(project.scale) / 1000;
  set(layers.hands, { viewBox: `0 0 ${frame.width} ${frame.height}` });
  const names = parts.map(({ kind, name }) => `${kind} ${name}`).join("\n");
  if (layers.names !== names) {
    layers.names = names;
    layers.targets.replaceChildren(...parts.map(({ kind, name }) => svg("circle", { r: TARGET, tabindex: 0, role: "button", "data-kind": kind, "data-name": name })));
  }
  const chosen = state.selection.peek();
  parts.forEach(({ kind, name, at }, order) => {
    const [cx, cy] = spot(view, at).map((value) => value.toFixed(1));
    const active = chosen?.kind === kind && chosen.name === name;
    const where = kind === "links" ? "" : `, at ${at.map((value) => stated(onGrid(value, sheet.finest) + 0, "m")).join(", ")}`;
    set(layers.targets.children[order], { cx, cy, class: `handle${active ? " chosen" : ""}${kind === "links" ? " of-link" : ""}`, "aria-label": `${{ joints: "Joint", points: "Point", links: "Link" }[kind]} ${name}${where}` }); // prettier-ignore
  });
  arms(view, layers, parts.find(({ kind, name }) => kind === chosen?.kind && name === chosen.name));
}

/** Whether a part can be moved by hand: a joint or point that the file states the place of. */
function movable(part) {
  const { entries } = state.answer.value ?? {};
  if (part?.kind === "points") return state.solved.value;
  return part?.kind === "joints" && state.solved.value && dictionary(entries?.joints)[part.name] !== undefined;
}

/** Arrows along x, y and z from the chosen joint or point. */
function arms(view, layers, part) {
  const shown = part && movable(part) ? AXES : [];
  if (layers.arms.children.length !== shown.length) {
    layers.arms.replaceChildren(...shown.map((name, axis) => svg("g", { class: `arm of-${name}`, "data-axis": axis }, svg("path", { class: "wide" }), svg("path", { class: "line" }), svg("text", {}, name))));
  }
  shown.forEach((_, axis) => {
    const [x, y] = spot(view, part.at);
    const [dx, dy] = [view.project.matrix[0][axis] * ARM, -view.project.matrix[1][axis] * ARM];
    const length = Math.hypot(dx, dy);
    const arm = layers.arms.children[axis];
    set(arm, { visibility: length < LEAST ? "hidden" : null });
    const [ux, uy] = [dx / (length || 1), dy / (length || 1)];
    const from = [x + TARGET * ux, y + TARGET * uy];
    set(arm.children[0], { d: `M${from}l${dx},${dy}` });
    set(arm.children[1], { d: arrow(...from, dx, dy) });
    set(arm.children[2], { x: from[0] + dx + 9 * ux, y: from[1] + dy + 9 * uy, dy: "0.34em", class: "middle" });
  });
}

// ---- the hand

/** Listen to the pointer and the keys on the picture; what turns it is `steer`'s. */
function listen(element) {
  let from = null;
  element.addEventListener("pointerdown", (event) => {
    const arm = event.target.closest?.("[data-axis]");
    const part = arm ? state.selection.value : partUnder(event.target);
    from = { at: [event.clientX, event.clientY], part, still: !from }; // a second finger turns and zooms
    if (event.button !== 0 || !part || !event.target.closest(".hands")) return;
    if (arm || movable(part)) {
      event.stopPropagation(); // it does not turn
      stage.held = taken(part, arm ? Number(arm.dataset.axis) : null);
      element.setPointerCapture(event.pointerId);
    }
  }, true); // prettier-ignore
  element.addEventListener("pointermove", (event) => {
    if (!from) return;
    const [dx, dy] = [event.clientX - from.at[0], event.clientY - from.at[1]];
    from.still &&= Math.hypot(dx, dy) <= STILL;
    if (stage.held && !from.still) pull(dx, dy);
  });
  element.addEventListener("pointerup", (event) => {
    const { held } = stage;
    stage.held = null;
    if (from?.still && event.button === 0) take(from.part ?? under(event));
    else if (held) place(held);
    from = null;
  });
  element.addEventListener("pointercancel", () => {
    from = stage.held = state.live.value = null;
    rubber();
  });
  element.addEventListener("keydown", keyed, true);
}

function under(event) {
  const box = stage.api.view.stage.getBoundingClientRect();
  const name = linkAt(stage.api.view, [event.clientX - box.left, event.clientY - box.top]);
  return name && { kind: "links", name };
}

function take(part) {
  state.selection.value = part && { kind: part.kind, name: part.name };
  if (part && state.tab.value !== "plots") state.tab.value = "properties";
}

/** A joint or point in the hand; its mechanism is shown as it comes to be. */
function taken(part, axis) {
  const { posed: index } = stage.api.view;
  const held = { part, axis, by: [0, 0, 0], at: null, ask: null };
  held.ask = newest((by) => changed("drag", { point: part.name, by, index }), (found) => {
    if (stage.held !== held) return;
    if (found.error) state.say(found.error, true);
    else state.live.value = found;
  }); // prettier-ignore
  return held;
}

/** The chosen part is pulled by so many px: along its axis, or in the plane of the picture. */
function pull(dx, dy) {
  const { held, api } = stage;
  const { matrix, scale } = api.view.project;
  const [right, up] = matrix;
  const fine = gridStep(scale) / 10;
  if (held.axis === null) held.by = AXES.map((_, axis) => onGrid((right[axis] * dx - up[axis] * dy) / scale, fine));
  else {
    const [ux, uy] = [right[held.axis], -up[held.axis]]; // of the axis in the picture
    held.by = AXES.map((_, axis) => (axis === held.axis ? onGrid((dx * ux + dy * uy) / (ux * ux + uy * uy) / scale, fine) : 0));
  }
  state.say(`${held.part.name} by ${told(held.by)}.`);
  if (state.selection.peek()?.name !== held.part.name) take(held.part);
  rubber(held);
  held.ask(held.by);
}

/** The way of a joint in words: "x 3 mm, z −1 mm". */
function told(by) {
  const words = by.flatMap((value, axis) => (value ? [`${AXES[axis]} ${stated(value, "m")}`] : []));
  return words.join(", ") || "nothing";
}

/** Where what is pulled comes to, with the links that follow it; nothing to leave it off. */
function rubber(held = null) {
  const { view } = stage.api;
  const layer = view.stage.querySelector(".hands").firstElementChild;
  if (!held) return layer.replaceChildren();
  const parts = partsOf(view);
  const { at } = parts.find(({ kind, name }) => kind === held.part.kind && name === held.part.name);
  held.at ??= at; // where it was taken
  const to = held.at.map((value, axis) => value + held.by[axis]);
  const own = view.scene.joints.find(({ name }) => name === held.part.name)?.links ?? [held.part.name.split(".")[0]];
  const ends = view.scene.joints.filter(({ name, links }) => name !== held.part.name && links.some((link) => own.includes(link) && !view.links.get(link).ground));
  const [[x, y], [a, b]] = [spot(view, held.at), spot(view, to)];
  const lines = ends.map(({ name }) => `M${spot(view, parts.find((one) => one.name === name).at)}L${a},${b}`).join("");
  layer.replaceChildren(
    svg("path", { class: "rubber", d: `${lines}M${x},${y}L${a},${b}`, fill: "none" }),
    svg("text", { class: "measure", x: a + (a > view.frame.width / 2 ? -14 : 14), y: b - 18, "text-anchor": a > view.frame.width / 2 ? "end" : "start" }, told(held.by)),
  );
}

function place({ part, by }) {
  rubber();
  if (by.some(Boolean)) move(part, by);
  else state.live.value = null;
}

/** Move a joint or point by metres along x, y and z. */
function move({ name }, by, merge = null) {
  const { posed, scene } = stage.api.view;
  return edit([{ do: "move", point: name, by, index: posed, size: scene.size }], merge);
}

/** Keys on a joint, point or link: arrows along the axes of the world that lie nearest to them in the picture. */
function keyed(event) {
  const part = partUnder(event.target);
  if (!part || event.ctrlKey || event.metaKey) return;
  if (event.key === "Enter") {
    take(part);
    requestAnimationFrame(() => focusOn(".properties input"));
  } else {
    const [way, sign] = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, -1], PageDown: [2, 1] }[event.key] ?? [];
    if (way === undefined || !movable(part)) return;
    const step = gridStep(stage.api.view.project.scale) * (event.shiftKey ? 10 : event.altKey ? 0.1 : 1);
    const [axis, sense] = axesOf(stage.api.view.project.matrix)[way];
    take(part);
    move(part, AXES.map((_, order) => (order === axis ? onGrid(sign * sense * step, step) : 0)), `nudge ${part.name}`);
  }
  event.preventDefault();
  event.stopPropagation();
}

/** The axes of the world that lie nearest to right, up and towards the viewer, each with its sense. */
function axesOf([right, up]) {
  const nearest = (row, but) => row.reduce((best, value, axis) => (axis !== but && (best === null || Math.abs(value) > Math.abs(row[best])) ? axis : best), null);
  const x = nearest(right);
  const y = nearest(up, x);
  const z = 3 - x - y;
  const [u, v] = [Math.sign(right[x]) || 1, Math.sign(up[y]) || 1];
  const even = (y - x + 3) % 3 === 1; // x, y, z in their order are right-handed
  return [[x, u], [y, v], [z, u * v * (even ? 1 : -1)]]; // prettier-ignore
}

/** The step of the grid in a unit, with the digits it needs. */
const stepIn = (unit) => /** @type {[number, string, number]} */ ([gridStep(stage.api.view.project.scale), unit, gridStep(stage.api.view.project.scale)]);

/** Buttons that move what is chosen by a step: for those who do not drag. */
function Mover() {
  const part = state.selection.value;
  const [typed, setTyped] = useState(null);
  if (!state.solved.value || !movable(part)) return null;
  const unit = usualUnit(state.answer.value.entries);
  const usual = stage.api?.view.project ? lengthText(...stepIn(unit)) : `1 ${unit}`;
  const step = lengthOf(typed ?? usual, unit);
  const put = ({ target }) => (lengthOf(plainNumber(target.value), unit) ? setTyped(plainNumber(target.value)) : (target.value = typed ?? usual));
  const by = (axis, sign) => () => step && move(part, AXES.map((_, order) => (order === axis ? sign * step : 0)), `step ${part.name}`);
  return html`<div class="mover" role="group" aria-label=${`Move ${part.name}`}><b>${part.name.split(".").pop()}</b>
    ${AXES.map((name, axis) => html`<span class="pair">
      <${Button} kind="icon" label=${`${part.name} by one step against ${name}`} onClick=${by(axis, -1)}>−<//><i class=${`of-${name}`}>${name}</i><${Button} kind="icon" label=${`${part.name} by one step along ${name}`} onClick=${by(axis, 1)}>+<//></span>`)}
    <label class="choice">step <input aria-label="Step" value=${typed ?? usual} onChange=${put} spellcheck=${false} /></label></div>`; // prettier-ignore
}
