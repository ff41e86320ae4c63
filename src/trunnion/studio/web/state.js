// What the page knows: the file and its places, the latest answer, what is chosen, and the steps that can be undone.

import { batch, computed, signal } from "@preact/signals";
/** @import { Signal } from "@preact/signals" */

const STEPS = 100; // that can be undone
export const VARIANT = "trunnion studio variant A";

export const connected = signal(false);
/** Why the program behind the page does not answer it, in words, or "". */
export const stopped = signal("");
/** What went wrong in the page itself, an error; or null. */
export const failure = signal(null);
/** Of the program: {version, examples, laws}. @type {Signal<Record<string, any>>} */
export const about = signal({ version: "", examples: [], laws: [] });
/** Of the opened folder: {folder, id, names}. */
export const folder = signal({ folder: "", id: "", names: [] });
/** Name of the open file in the folder, or null for a sheet that was never saved. */
export const fileName = signal(null);
/** How many sheets were opened. */
export const opened = signal(0);
export const savedText = signal("");
/** The text of the file that the work was begun from; another than `savedText` where the file was changed since. */
export const basis = signal("");
/** Whether the browser has no room for the present work. */
export const unkept = signal(false);
export const text = signal("");
/** World positions, m, by "link.point": what unfinished mechanisms are drawn from. */
export const places = signal({});
/** Answer to the latest `model` question, with the text it is for. */
export const answer = signal(null);
export const busy = signal(0);
export const index = signal(0);
/** How far a played mechanism is from this position to the next, 0 to 1. */
export const share = signal(0);
/** {kind, name}, kind being links, joints, points, loads, springs or drivers; or null. */
export const selection = signal(null);
export const tool = signal("select");
/** First end of what is being drawn: {at, written, …}, or null. */
export const pending = signal(null);
/** Names of links that are chosen together. @type {Signal<string[]>} */
export const group = signal([]);
/** Corners of the box that chooses links, m, while it is drawn; or null. @type {Signal<number[][] | null>} */
export const boxed = signal(null);
/** How far the chosen links are dragged by now, m; or null. @type {Signal<number[] | null>} */
export const shifted = signal(null);
/** The end or place on a link {kind, name, on, at} that a dragged end is joined with where it is let go, or null. */
export const dropping = signal(null);
/** Answer to the latest `drag` question while a joint is dragged. */
export const live = signal(null);
/** How many times as large as they are errors and play are drawn. */
export const factor = signal(1);
/** Answer to the latest `corner` question, with the measure and the scene `of` which it is the corner; or null. */
export const corner = signal(null);
export const past = signal([]);
export const future = signal([]);
/** "stated", "compare" (and without) or "off". */
export const friction = signal("stated");
export const layers = signal({
  seats: true, nominal: true,
  curves: true, reactions: true, values: false, velocity: true, acceleration: true, centres: false, relative: false, circles: false,
  transmission: false, variant: true, names: true, grid: true, masses: true, dimensions: false, others: false, peaks: false,
}); // prettier-ignore
export const snapping = signal(true);
export const tab = signal("properties");
/** A line of the file that is to be shown, or null. */
export const line = signal(null);
export const dialog = signal(null);
/** {words, bad}: the latest remark, said to screen readers too. */
export const notice = signal({ words: "", bad: false });
/** Work that was left unsaved on a sheet that is not the open one, {name, time, key}, its name null for one that has none; or null. */
export const waiting = signal(null);
/** When the recovered work was left, or null. */
export const recovered = signal(null);
/** Variant A, {text, friction, time}: the state that was kept to compare with; or null. It is kept with the work. */
export const variant = signal(read(sessionStorage, VARIANT));

export const unsaved = computed(() => text.value !== savedText.value);
let inSpace = false;
/** Whether the model is one in space; while its text cannot be read, as it was before. */
export const spatial = computed(() => {
  const { scene, entries } = answer.value ?? {};
  if (scene) inSpace = scene.space === "spatial";
  else if (entries) inSpace = entries.space === "spatial" || Array.isArray(entries.loop);
  return inSpace;
});
/** Whether what is shown is of a text, or a friction, that is no longer the present one: its answer is awaited. */
export const awaited = computed(() => {
  const { scene, text: known, friction: law } = answer.value ?? {};
  return Boolean(scene) && (known !== text.value || (law === "off") !== (friction.value === "off"));
});
export const solved = computed(() => Boolean(answer.value?.solved && answer.value.scene));

/** What a half-drawn linkage still lacks, in sentences; then its errors are no more than that. */
export const missing = computed(() => answer.value?.missing ?? []);
export const findings = computed(() => {
  const found = text.value.trim() ? (answer.value?.findings ?? []) : [];
  return missing.value.length ? found.filter(({ severity }) => severity !== "error") : found;
});

export function say(words, bad = false) {
  notice.value = { words, bad };
}

/**
 * Take a text with its places as the present ones, `before` {text, places} becoming a step to undo. Steps with the same
 * `merge` in a row (arrow keys, a slider, typed letters) are one.
 */
export function commit(name, before, next, merge = null) {
  const last = past.value[past.value.length - 1];
  batch(() => {
    if (!merge || last?.merge !== merge) past.value = [...past.value, { name, merge, ...before }].slice(-STEPS);
    else past.value = [...past.value.slice(0, -1), { ...last, name }]; // what it came to
    future.value = [];
    text.value = next.text;
    places.value = next.places;
  });
}

/** The next step is one of its own. */
export function settle() {
  const last = past.value[past.value.length - 1];
  if (last?.merge) past.value = [...past.value.slice(0, -1), { ...last, merge: null }];
}

function swap(from, to) {
  const step = from.value[from.value.length - 1];
  if (!step) return null;
  batch(() => {
    from.value = from.value.slice(0, -1);
    to.value = [...to.value, { name: step.name, text: text.value, places: places.value }];
    text.value = step.text;
    places.value = step.places;
    recovered.value = null;
  });
  return step.name;
}

/** The name of the step that was undone, or null. */
export const undo = () => swap(past, future);
/** The name of the step that was done again, or null. */
export const redo = () => swap(future, past);

/** Begin with a text; nothing of what was before can be undone. */
export function begin({ name, saved, content, steps = null }) {
  batch(() => {
    fileName.value = name;
    savedText.value = saved;
    basis.value = steps && content !== saved ? steps.saved : saved;
    text.value = content;
    places.value = steps?.places ?? {};
    past.value = steps?.past ?? [];
    future.value = steps?.future ?? [];
    corner.value = null;
    factor.value = 1;
    answer.value = null;
    friction.value = "stated";
    selection.value = null;
    pending.value = null;
    live.value = null;
    dropping.value = null;
    group.value = [];
    index.value = 0;
    share.value = 0;
    tool.value = "select";
    if (opened.value) variant.value = null; // of another sheet; a page that is loaded again has the one it had
    opened.value += 1;
    recovered.value = steps && content !== saved ? steps.time : null;
    variant.value = steps?.variant ?? variant.value;
  });
}

/** What a storage of the browser has under a key; null where it has nothing that can be read. */
export function read(storage, key) {
  try {
    return JSON.parse(storage.getItem(key) ?? "null");
  } catch {
    return null; // storage is off, or of another version
  }
}
