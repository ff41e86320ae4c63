// What can be shown over the mechanism: its names, and what of it is asked of Python when it is wanted.

import { computed, effect, signal, untracked } from "@preact/signals";
import { askOf } from "./actions.js";
import * as state from "./state.js";

/** Layers of the sheet and their names, in the order of the menu. */
export const LAYERS = [
  ["reactions", "Reactions"],
  ["values", "Values of the reactions"],
  ["curves", "Paths of points"],
  ["velocity", "Velocity of the chosen point"],
  ["acceleration", "Acceleration of the chosen point"],
  ["centres", "Instant centres against the ground"],
  ["relative", "Instant centres between links"],
  ["circles", "Friction circles"],
  ["transmission", "Transmission angles"],
  ["variant", "Variant A as a ghost"],
  ["seats", "Pins in their holes, errors magnified"],
  ["nominal", "Without errors, as a ghost"],
  ["names", "Names"],
  ["masses", "Mass centres"],
  ["dimensions", "Dimensions"],
  ["grid", "Grid"],
  ["others", "Other assemblies"],
  ["peaks", "Whole peaks in plots"],
];

/** A scene for charts, which cut peaks near dead centres unless they are wanted whole. */
export const framed = (scene) => (state.layers.value.peaks ? { ...scene, ease: [] } : { ...scene, whole: "choose Show, Whole peaks in plots." });

/** {link, at, index}: the place on a link that was clicked and the position it was clicked at, or null. */
export const clicked = signal(null);

/** {point: "link.point"} of the chosen point or joint, {place} of the place that was clicked on the chosen link, or {}. */
const watched = computed(() => {
  const { kind, name } = state.selection.value ?? {};
  if (kind === "points") return { point: name };
  if (kind === "links") return clicked.value?.link === name ? { place: clicked.value } : {};
  const joint = kind === "joints" && state.answer.value?.scene?.joints.find((one) => one.name === name);
  return joint ? { point: joint.at } : {};
});

/** A place on a link as it was clicked, and what is the same when the model has changed: {link, start, local}. */
const held = { clicked: null, same: null };

/** {scene, point, centres, circles, transmission, seats} of the scene that is shown, as far as it is wanted; or null. */
export const laid = signal(null);

/** Ask for them whenever they are wanted and there is a new answer. */
export function keepLayers() {
  const wanted = computed(() => {
    const { centres, relative, circles, transmission, seats } = state.layers.value;
    const seated = seats && state.factor.value > 1 && Boolean(state.answer.value?.scene?.built?.seats.length);
    return Object.entries({ centres: centres || relative, circles, transmission, seats: seated }).filter(([, shown]) => shown).map(([name]) => name).join(" ");
  }); // prettier-ignore
  effect(() => {
    const [names, { point, place }] = [wanted.value, watched.value];
    const scene = state.solved.value ? state.answer.value.scene : null;
    untracked(() => {
      if (laid.value?.scene !== scene) laid.value = null;
      if (!scene || (!names && !point && !place)) laid.value = null;
      else
        askOf("layers", { point, place: held.clicked === place ? held.same : place, wanted: names.split(" ") }).then((found) => {
          if (!found) return;
          if (place && found.point) Object.assign(held, { clicked: place, same: { link: place.link, start: found.point.start, local: found.point.local } });
          laid.value = { ...found, scene };
        });
    });
  });
}

const STILL = 3; // px that a click may move

/** A click on a link with nothing in hand: the place there is watched. Returns what ends it. */
export function listenToPlaces(root, view) {
  let from = null;
  const down = (event) => {
    const part = event.target.closest?.("[data-kind]");
    const link = event.button === 0 && state.tool.value === "select" && ["links", "centres"].includes(part?.dataset.kind) ? part.dataset.name : null;
    from = link && { link, x: event.clientX, y: event.clientY };
  };
  const up = (event) => {
    if (!from || Math.hypot(event.clientX - from.x, event.clientY - from.y) > STILL || !state.solved.value || view.ideal) return;
    const box = root.getBoundingClientRect();
    clicked.value = { link: from.link, at: view.frame.from([event.clientX - box.left, event.clientY - box.top]), index: view.posed };
  };
  root.addEventListener("pointerdown", down);
  root.addEventListener("pointerup", up);
  return () => {
    root.removeEventListener("pointerdown", down);
    root.removeEventListener("pointerup", up);
  };
}
