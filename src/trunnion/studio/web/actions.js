// What the page does with Python: solve the text, carry out gestures as named steps, open, save, export.

import { effect, untracked } from "@preact/signals";
import * as state from "./state.js";
import { placesAt, posedAt } from "./geometry.js";
import { connection } from "./socket.js";

const STEPS = 360; // positions of a run
const TYPING = 350; // ms of quiet before typed text is solved

let link;

/** Connect, read the program's examples and the opened folder, open what is to be opened. */
export const start = () => counted(begun());

async function begun() {
  link = connection(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`, (open) => {
    state.connected.value = open;
    if (open && untracked(() => state.text.value)) solve();
  });
  const [about, files] = await Promise.all([link.ask("start", {}), fetch("/files").then((reply) => reply.json())]);
  if (about && !about.error) state.about.value = about;
  state.folder.value = { folder: files.folder, names: files.files };
  const last = state.lastSheet();
  const again = last?.folder === files.folder ? last.name : files.open;
  if (again && (files.open === again || files.files.includes(again))) await openFile(again);
  else openSheet({ name: null, saved: "", content: "" });
  const left = state.kept(null);
  if (state.fileName.value !== null && left && left.text !== left.saved) state.waiting.value = left.time;
  state.keepSteps();
  effect(() => {
    state.friction.value; // another friction is another answer
    untracked(solve);
  });
}

/** A promise that counts as work until it is settled. */
async function counted(promise) {
  state.busy.value += 1;
  try {
    return await promise;
  } finally {
    state.busy.value -= 1;
  }
}

/** Ask for the answer to the present text. */
export function solve() {
  return counted(answered());
}

async function answered() {
  const sent = state.text.value;
  const friction = state.friction.value;
  const asked = { text: sent, steps: STEPS, friction: friction === "off" ? "off" : "stated", ideal: friction === "compare" };
  const found = await link.ask("model", asked);
  if (!found || sent !== state.text.value) return;
  if (found.error) return state.say(found.error, true);
  state.answer.value = { ...found, text: sent };
  if (state.live.value?.text === null) state.live.value = null; // the dragged mechanism has its answer
  const count = found.scene?.count ?? 1;
  if (state.index.value >= count) state.index.value = 0;
  if (!state.solved.value) state.places.value = { ...found.places, ...state.places.value };
}

let typing = 0;

/** Solve when nothing was typed for a while. */
function solveSoon() {
  clearTimeout(typing);
  typing = setTimeout(solve, TYPING);
}

/** Text, places and locks of the mechanism as it is shown: what a gesture starts from. */
export function present() {
  const { scene } = state.answer.value ?? {};
  const fresh = state.solved.value && state.answer.value.text === state.text.value && !state.spatial.value;
  const places = fresh ? { ...state.places.value, ...placesAt(scene, posedAt(scene, state.index.value)) } : state.places.value;
  return { text: state.text.value, places, locked: state.locked.value };
}

let queue = Promise.resolve();

/**
 * Carry out gestures as one step to undo; one after the other, for each starts from what the one before left.
 * Steps in a row with the same `merge` are undone as one. Whether it could be done.
 */
export function edit(gestures, merge = null) {
  queue = queue.then(() => carryOut(gestures, merge)).catch((problem) => refuse(String(problem.message ?? problem)));
  return counted(queue);
}

async function carryOut(gestures, merge) {
  const before = present();
  const done = await link.ask("edit", { ...before, gestures });
  if (!done) return refuse("The connection was lost; the step was not carried out.");
  if (done.error) return refuse(done.error);
  state.commit(sentence(done.says, ""), before, done, merge);
  if (done.made) state.selection.value = { kind: done.made[0], name: done.made[1] };
  state.say(sentence(done.says));
  if (state.live.value) state.live.value = { ...state.live.value, text: null };
  await solve();
  return true;
}

function sentence(words, end = ".") {
  return `${words[0].toUpperCase()}${words.slice(1)}${end}`;
}

function refuse(words) {
  state.live.value = null;
  state.say(/[.!?]$/.test(words) ? words : `${words}.`, true);
  return false;
}

/** Write one value of the file. */
export function setValue(path, value, merge = null) {
  return edit([{ do: "set", path, value }], merge);
}

/** Where the mechanism would be with a point at another place. */
export function drag(fields) {
  return link.ask("drag", { text: state.text.value, steps: STEPS, locked: state.locked.value, ...fields });
}

/** The other assemblies of the present text. */
export async function assemblies() {
  const found = await link.ask("assemblies", { text: state.text.value, steps: STEPS });
  return found?.others ?? [];
}

/** Take typed text; words typed in one go are one step. */
export function typed(content) {
  const before = present();
  state.commit("Edit text", before, { ...before, text: content }, "typing");
  solveSoon();
}

export function undo() {
  const name = state.undo();
  if (name) after(`Undone: ${name}`);
}

export function redo() {
  const name = state.redo();
  if (name) after(`Done again: ${name}`);
}

function after(words) {
  state.live.value = null;
  state.pending.value = null;
  state.say(`${words}.`);
  solve();
}

/** Open a sheet with a text; its steps, and work that was left of it unsaved, are taken up again. */
export function openSheet({ name, saved, content }) {
  const left = state.kept(name);
  const found = left && (name === null || left.text === saved || left.text !== left.saved) ? left : null;
  state.begin({ name, saved: name === null && found ? found.saved : saved, content: found?.text ?? content, steps: found });
  state.dialog.value = null;
  return solve();
}

/** Open the unsaved sheet without a name, or throw it away. */
export function takeWaiting(open) {
  state.waiting.value = null;
  if (open) return openSheet({ name: null, saved: "", content: "" });
  state.forget(null);
  return null;
}

/** Leave the recovered work and go back to the file as it was saved. */
export function discard() {
  state.forget(state.fileName.value);
  openSheet({ name: state.fileName.value, saved: state.savedText.value, content: state.savedText.value });
}

export function openFile(name) {
  return counted(fetched(name));
}

async function fetched(name) {
  const reply = await fetch(`/file/${encodeURIComponent(name)}`);
  if (!reply.ok) return state.say(`${name} could not be read.`, true);
  const content = await reply.text();
  await openSheet({ name, saved: content, content });
}

/** A new sheet with a text that is in no file of the folder yet; work on a sheet without a name comes back by undo. */
export function openText(content, words) {
  const left = state.fileName.value === null && state.unsaved.value ? { name: words, ...present() } : null;
  state.forget(null);
  const opened = openSheet({ name: null, saved: content, content });
  if (left) state.past.value = [left];
  state.say(`${words}.`);
  return opened;
}

export function openExample(example) {
  return counted(shipped(example));
}

async function shipped({ name, title }) {
  const found = await link.ask("example", { name });
  if (!found) return;
  if (found.error) return state.say(found.error, true);
  await openText(found.text, `Example ${title || name} opened`);
}

/** Save under the name, or ask for one. */
export function save(name = state.fileName.value) {
  return name ? counted(stored(name)) : void (state.dialog.value = "save");
}

async function stored(name) {
  const content = state.text.value;
  const there = name === state.fileName.value ? await fetch(`/file/${encodeURIComponent(name)}`) : null;
  if (there?.ok && ![state.savedText.value, content].includes(await there.text()))
    return state.say(`${name} was changed elsewhere since it was opened; save under another name, or open it again.`, true);
  const reply = await fetch(`/file/${encodeURIComponent(name)}`, { method: "PUT", body: content });
  const told = await reply.json().catch(() => ({ error: `${name} could not be saved.` }));
  if (told.error) return state.say(told.error, true);
  if (told.saved !== state.fileName.value) state.forget(state.fileName.value);
  state.fileName.value = told.saved;
  state.savedText.value = content;
  state.recovered.value = null;
  state.dialog.value = null;
  const { folder, names } = state.folder.value;
  state.folder.value = { folder, names: [...new Set([...names, told.saved])].sort() };
  state.say(`Saved as ${told.saved}.`);
}

/** Export and hand the file to the browser. */
export async function exported(what) {
  state.say(`${what.toUpperCase()} is being made …`);
  const made = await counted(link.ask("export", { text: state.text.value, what, steps: STEPS }));
  if (!made) return;
  if (made.error) return state.say(made.error, true);
  const [first, count] = made.bytes.bytes;
  const address = URL.createObjectURL(new Blob([made.body.slice(first, first + count)], { type: made.mime }));
  const anchor = Object.assign(document.createElement("a"), { href: address, download: made.name });
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
  state.say(`${made.name} exported.`);
}
