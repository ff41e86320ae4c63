// The sheet: the mechanism, the grid, what is being drawn; pan, zoom, and the pointer's gestures.

import { effect, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { place } from "../web/data.js";
import { set, svg } from "../web/dom.js";
import { stated } from "../web/format.js";
import { build, drawing, drawTracks, pose, TARGET } from "./drawing.js";
import { gridStep } from "./geometry.js";
import { others, poseGhosts } from "./ghosts.js";
import { boxTo, groupMarks } from "./group.js";
import { listenToPointer } from "./hand.js";
import { laid } from "./layers.js";
import { massSpots, poseMasses } from "./masses.js";
import { addOverlay, poseOverlay } from "./overlay.js";
import { drawn, kindsOf, sheet, shown } from "./sheet.js";
import { rings } from "./start.js";
import * as state from "./state.js";
import { pointer, toolOf, typed, typedEnd } from "./tools.js";
import { html } from "./ui.js";
import { compared } from "./variants.js";

export function Stage() {
  const holder = useRef(null);
  useEffect(() => mount(holder.current), []);
  return html`<div class="sheet" ref=${holder}></div>`;
}

function mount(holder) {
  const root = svg("svg", {
    tabindex: 0,
    role: "application",
    "aria-label": "Sheet with the mechanism. Tab goes through its links and joints; arrow keys move the cross, Enter uses the tool there; a question mark lists the keys.",
  });
  holder.append(root);
  const view = drawing(root);
  addOverlay(view);
  sheet.view = view;
  sheet.beside = () => others.value;
  sheet.after = () => {
    chosen(view);
    untracked(() => preview(view));
  };
  const stop = [
    watchSize(holder, view),
    listenToPointer(root, view),
    effect(() => show(view)),
    effect(() => {
      state.selection.value;
      others.value;
      laid.value;
      compared.value;
      state.layers.value;
      untracked(() => chosen(view));
    }),
    effect(() => preview(view)),
  ];
  return () => {
    stop.forEach((end) => end());
    root.remove();
    sheet.view = null;
  };
}

function watchSize(holder, view) {
  const observer = new ResizeObserver(() => {
    const { clientWidth: width, clientHeight: height } = holder;
    if (!width || !height) return;
    sheet.resize(width, height);
    if (view.sized) return;
    view.sized = true;
    view.fresh = !shown.peek();
    sheet.fit();
  });
  observer.observe(holder);
  return () => observer.disconnect();
}

/** Build what is new, move what is known. */
function show(view) {
  const found = drawn.value;
  const { curves, reactions, names, grid } = state.layers.value;
  const index = state.index.value;
  if (!found) {
    if (!state.answer.value) view.fresh = true;
    return;
  }
  const other = view.shown.curves !== curves || view.shown.reactions !== reactions || view.shown.grid !== grid;
  view.shown = { curves, reactions, names, grid };
  view.index = index;
  view.ideal = found.ideal;
  if (view.structure !== found.structure || other) {
    view.structure = found.structure;
    build(view, found.scene, kindsOf(found.scene));
  } else if (view.scene !== found.scene) {
    view.scene = found.scene;
    drawTracks(view);
  }
  pose(view, found.scene, index, state.share.value);
  if (view.fresh && view.sized) {
    view.fresh = false;
    untracked(sheet.fit);
  }
  untracked(() => chosen(view));
}

function chosen(view) {
  if (!view.scene) return;
  const masses = massSpots(view);
  poseMasses(view, masses);
  poseHandles(view, [...sheet.spots(), ...masses], state.selection.value);
  markChosen(view, state.selection.value);
  poseGhosts(view, state.live.value ? [] : others.value);
  poseOverlay(view);
}

/** The cross, the snap mark, and the line that is being drawn with its length. */
function preview(view) {
  const { layers, frame } = view;
  const from = state.pending.value;
  const now = pointer.value;
  const parts = [];
  view.root.classList.toggle("drawing", state.tool.value !== "select");
  if (now && (state.tool.value !== "select" || now.keyboard)) {
    const [x, y] = frame.to(now.spot.at);
    parts.push(svg("path", { class: "cross", d: `M${x - 9},${y}h18M${x},${y - 9}v18` }));
    if (now.spot.kind) parts.push(svg("circle", { class: "snap", cx: x, cy: y, r: 11 }));
    if (now.spot.on && toolOf().on) parts.push(svg("rect", { class: "snap", x: x - 9, y: y - 9, width: 18, height: 18 }));
  }
  const drop = state.dropping.value;
  if (drop) {
    const [x, y] = frame.to(drop.at);
    parts.push(svg("circle", { class: "snap", cx: x, cy: y, r: 13 }));
  }
  parts.unshift(...groupMarks(view), ...rings(view));
  if (from && now && state.tool.value === "box") parts.push(boxTo(frame, from.at, now.spot.at));
  else if (from && now) parts.push(...rubber(frame, from, now.spot));
  layers.tools.replaceChildren(...parts);
}

function rubber(frame, from, to) {
  const [[x1, y1], [x2, y2]] = [frame.to(from.at), frame.to(typedEnd(to.at) ?? to.at)];
  const words = toolOf().tells?.(from, to, frame) ?? "";
  const label = svg("text", { class: typed.value ? "measure typed" : "measure", x: (x1 + x2) / 2 + 12, y: (y1 + y2) / 2 - 12 }, words);
  const line = svg("line", { class: "rubber" });
  set(line, { x1, y1, x2, y2 });
  return [line, label];
}

// ---- handles -------------------------------------------------------------------------------------------------------

const NOUNS = { joints: "Joint", points: "Point", centres: "Mass centre of" };
const MOST = 400; // targets; of larger mechanisms the list under Properties chooses
const FEW = 60; // that are put at every picture; to move more takes longer than a picture has, and they follow
const REST = 150; // ms after which they do

/** Put targets over the spots; `chosen` {kind, name} is marked. */
function poseHandles(view, spots, chosen) {
  const few = spots.slice(0, MOST);
  const names = few.map(({ kind, name }) => `${kind} ${name}`).join("\n");
  const fresh = view.handled !== names;
  if (fresh) buildHandles(view, few, names);
  view.target = targets(view, few, chosen);
  if (fresh || few.length <= FEW) return view.target();
  if (chosen) view.target(chosen);
  view.waits ??= setTimeout(() => ((view.waits = null), view.target()), REST);
}

/** A function that puts the targets, or that of the chosen spot alone, over their spots. */
function targets({ layers, frame, scene, drawn }, few, chosen) {
  const least = gridStep(frame.scale) / 1000; // what a hand can tell apart: less is rounding
  const coordinate = (value) => stated(Math.abs(value) < least ? 0 : value, "m");
  const same = (one, other) => one.kind === other?.kind && one.name === other.name;
  return (only = null) => {
    const joints = only ? [] : few.filter(({ kind }) => kind !== "centres").map((one) => frame.to(one.at));
    few.forEach((one, order) => {
      if (only && !same(one, only)) return;
      const { kind, name, key, at, mass } = one;
      const [x, y] = frame.to((key && place(scene, key, drawn)) ?? at); // errors may be drawn larger
      const words = `${NOUNS[kind]} ${name}${mass ? `, ${Number(mass.toPrecision(4))} kg` : ""}, at ${coordinate(at[0])}, ${coordinate(at[1])}`;
      set(layers.handles.children[order], {
        cx: x.toFixed(1),
        cy: y.toFixed(1),
        "aria-label": words,
        class: same(one, chosen) ? "handle chosen" : mass && joints.some((spot) => Math.hypot(spot[0] - x, spot[1] - y) < TARGET) ? "handle under" : "handle",
      });
    });
  };
}

function buildHandles(view, spots, names) {
  const { handles } = view.layers;
  const active = document.activeElement;
  const held = active instanceof SVGElement && handles.contains(active) ? active.dataset : null;
  view.handled = names;
  handles.replaceChildren(
    ...spots.map(({ kind, name, key }) =>
      svg("circle", { r: TARGET, tabindex: 0, role: "button", "data-kind": kind, "data-name": name, "data-key": key }),
    ),
  );
  if (held) [...handles.children].find((one) => one.dataset.kind === held.kind && one.dataset.name === held.name)?.focus();
}

/** Mark the chosen link, load or spring. */
function markChosen(view, chosen) {
  for (const node of view.root.querySelectorAll("g[data-kind]")) {
    node.classList.toggle("chosen", node.dataset.kind === chosen?.kind && node.dataset.name === chosen.name);
  }
}
