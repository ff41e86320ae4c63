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

/** {point: "link.point"} of the chosen point or joint, or {}. */
const watched = computed(() => {
  const { kind, name } = state.selection.value ?? {};
  if (kind === "points") return { point: name };
  const joint = kind === "joints" && state.answer.value?.scene?.joints.find((one) => one.name === name);
  return joint ? { point: joint.at } : {};
});

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
    const [names, { point }] = [wanted.value, watched.value];
    const scene = state.solved.value ? state.answer.value.scene : null;
    untracked(() => {
      if (laid.value?.scene !== scene) laid.value = null;
      if (!scene || (!names && !point)) laid.value = null;
      else askOf("layers", { point, wanted: names.split(" ") }).then((found) => found && (laid.value = { ...found, scene }));
    });
  });
}
