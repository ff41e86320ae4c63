// What can be shown over the mechanism: its names, and what of it is asked of Python when it is wanted.

import { computed, effect, signal, untracked } from "@preact/signals";
import { at } from "../web/data.js";
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

/** "link.point" of the chosen point or joint, or null. */
const watched = computed(() => {
  const { kind, name } = state.selection.value ?? {};
  if (kind === "points") return name;
  return (kind === "joints" && state.answer.value?.scene?.joints.find((one) => one.name === name)?.at) || null;
});

const RATES = ["velocity", "acceleration"];

/** Names of the columns that have the motion of a point. */
export const columnsOf = (point) => (point ? RATES.flatMap((rate) => ["x", "y", "z"].map((axis) => `${point}.${rate}_${axis}`)) : []);

/** Velocity, m/s, and acceleration, m/s², of a point by axis, from columns; null where there are none. */
export function motionOf(columns, point) {
  const parts = (rate) => Object.fromEntries(["x", "y", "z"].flatMap((axis) => {
    const column = columns[`${point}.${rate}_${axis}`];
    return column ? [[axis, column.values]] : [];
  })); // prettier-ignore
  const [velocity, acceleration] = RATES.map(parts);
  return velocity.x ? { key: point, velocity, acceleration } : null;
}

/**
 * Friction circles of the journals that rub, [{joint, radius, offset}], m, at every position: their radius is |M|/|F|, for Coulomb's
 * law f′ r. `offset`: of the line of action of both together from the middle of the pin, M/|F|, to the right of F where
 * positive; null where the joint rests, for friction is an interval there, and the radius that of the position before.
 */
export function circlesOf(columns, { joints, count }) {
  return joints.flatMap(({ name, reaction }) => {
    const torque = columns[`${name}.friction_torque`]?.values ?? [];
    const offset = torque.map((moment, index) => moment / Math.hypot(at(reaction.x, index), at(reaction.y, index))).map((arm) => (Number.isFinite(arm) && arm !== 0 ? arm : null));
    let last = offset.findLast((arm) => arm !== null);
    if (last === undefined) return [];
    const radius = Array.from({ length: count }, (_, index) => Math.abs((last = offset[index] ?? last)));
    return [{ joint: name, radius, offset }];
  });
}

/** {scene, point, centres, circles, transmission, seats} of the scene that is shown, as far as it is wanted; or null. */
export const laid = signal(null);

/** Ask for them whenever they are wanted and there is a new answer. */
export function keepLayers() {
  const wanted = computed(() => {
    const { centres, relative, circles, transmission, seats } = state.layers.value;
    const seated = seats && state.factor.value > 1 && Boolean(state.answer.value?.scene?.built?.seats.length);
    return Object.entries({ centres: centres || relative, circles, transmission, seats: seated }).filter(([, shown]) => shown).map(([name]) => name).join(" ");
  }); // prettier-ignore
  const dragged = computed(() => Boolean(state.live.value)); // then none of it is drawn, and who drags would wait for it
  effect(() => {
    if (dragged.value) return;
    const [layers, point] = [wanted.value, watched.value];
    const scene = state.solved.value ? state.answer.value.scene : null;
    untracked(() => {
      if (laid.value?.scene !== scene) laid.value = null;
      if (!scene || (!layers && !point)) return void (laid.value = null);
      const round = layers.includes("circles") && !state.spatial.value;
      const names = [...columnsOf(point), ...(round ? scene.joints.map(({ name }) => `${name}.friction_torque`) : [])];
      askOf("layers", { names, wanted: layers.split(" ") }).then((found) => {
        if (found) laid.value = { ...found, scene, point: motionOf(found.columns, point), ...(round ? { circles: circlesOf(found.columns, scene) } : {}) };
      });
    });
  });
}
