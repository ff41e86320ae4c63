// What the browser keeps of the work over a reload and a crash, for each folder, sheet and tab.

import { effect } from "@preact/signals";
import { unique } from "./socket.js";
import * as state from "./state.js";

const ROOM = 2e6; // characters of a sheet that are kept
const LAST = "trunnion studio last sheet";
const TAB = "trunnion studio tab";
const WORK = "trunnion studio work ";
const PATIENCE = 500; // ms that the tab before a reload may take to end

/** Names of the tabs of the browser that are open; each holds a lock of its name. */
let openTabs = new Set();
let tab = "";

/** The key of what belongs to a sheet, whatever tab shows it. */
export const keyOf = (name) => `trunnion studio ${state.folder.value.id} ${name ?? ""}`;
const workKey = (name) => WORK + JSON.stringify([state.folder.value.id, name, tab]);

/** Give this tab its name, which it had before it was loaded again; a tab that was duplicated takes a new one. */
export async function enterTab() {
  tab = state.read(sessionStorage, TAB) ?? unique();
  await held(tab).catch(() => held((tab = unique())));
  put(sessionStorage, TAB, tab);
  addEventListener("storage", lookForTabs); // another tab keeps work
  await lookForTabs();
}

function held(name) {
  return new Promise((resolve, reject) => {
    if (!navigator.locks) return resolve();
    const hold = () => (resolve(), new Promise(() => {})); // until the page is gone
    navigator.locks.request(name, { signal: AbortSignal.timeout(PATIENCE) }, hold).catch(reject);
  });
}

export async function lookForTabs() {
  openTabs = new Set((await navigator.locks?.query())?.held.map(({ name }) => name));
}

/**
 * What was left of the sheets of this folder, [{key, name, text, saved, places, past, future, variant, time}], by this tab and by
 * those that are closed; the latest first.
 */
function works() {
  const ours = (key) => {
    const [folder, name, owner] = key.startsWith(WORK) ? JSON.parse(key.slice(WORK.length)) : [];
    return folder === state.folder.value.id && (owner === tab || !openTabs.has(owner)) ? { ...state.read(localStorage, key), key, name } : null;
  };
  try {
    return Object.keys(localStorage).map(ours).filter((one) => one?.time).sort((a, b) => b.time.localeCompare(a.time)); // prettier-ignore
  } catch {
    return []; // storage is off
  }
}

const unsaved = ({ text, saved }) => text !== saved;

/** What was left of a sheet: that of this tab before that of others, unsaved work before steps alone; or null. */
export function left(name) {
  const list = works().filter((one) => one.name === name);
  const rank = (one) => 2 * Number(unsaved(one)) + Number(one.key === workKey(name));
  return list.sort((a, b) => rank(b) - rank(a))[0] ?? null;
}

/** Take up what was left of a sheet; of a closed tab it is this one's from now on. */
export function takeUp(name) {
  const found = left(name);
  try {
    for (const one of works()) if (one.name === name && (one.key === found.key || !unsaved(one))) localStorage.removeItem(one.key);
    if (found) localStorage.setItem(workKey(name), JSON.stringify(found));
  } catch {
    // storage is off
  }
  return found;
}

/** The latest unsaved work on another sheet, {name, time, key}, where its file is one of these; or null. */
export function leftBehind(names) {
  return works().find((one) => unsaved(one) && one.name !== state.fileName.value && [null, ...names].includes(one.name)) ?? null;
}

export function forget(key) {
  try {
    localStorage.removeItem(key);
  } catch {
    // storage is off
  }
}

/** What this tab has left of a sheet is no longer kept. */
export const forgetOwn = (name) => forget(workKey(name));

/** The sheet that this tab showed before it was loaded again: {folder, name}, or null. */
export const lastSheet = () => state.read(sessionStorage, LAST);

/** Keep every step over a reload and a crash. */
export function keepSteps() {
  addEventListener("beforeunload", (event) => state.unkept.value && state.unsaved.value && event.preventDefault());
  effect(() => {
    const [saved, name, variant] = [state.basis.value, state.fileName.value, state.variant.value];
    const work = { text: state.text.value, saved, places: state.places.peek(), past: state.past.value, future: state.future.value, variant };
    put(sessionStorage, LAST, { folder: state.folder.value.id, name });
    put(sessionStorage, state.VARIANT, variant);
    const nothing = name && !unsaved(work) && !work.past.length && !work.future.length;
    state.unkept.value = !nothing && !keep(workKey(name), { ...work, time: new Date().toISOString() });
  });
}

/** Keep work with as many of its steps as there is room for; what is older than it must not pass for it. Whether there was room. */
function keep(key, work) {
  for (const most of [100, 50, 25, 12, 6, 3, 1]) {
    const content = { ...work, past: work.past.slice(-most), future: work.future.slice(-most) };
    if (JSON.stringify(content).length <= ROOM && put(localStorage, key, content)) return true;
  }
  if (put(localStorage, key, { ...work, past: [], future: [] })) return true;
  forget(key);
  return false;
}

function put(storage, key, value) {
  try {
    storage.setItem(key, JSON.stringify(value));
    return true;
  } catch {
    return false; // no room, or storage is off
  }
}
