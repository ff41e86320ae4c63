// What the page does with Python: solve the text, carry out gestures as named steps, open, save, export.

import { effect, untracked } from "@preact/signals";
import * as state from "./state.js";
import { isPart } from "./fields.js";
import { placesAt, posedAt, stemOf } from "./geometry.js";
import { enterTab, forget, forgetOwn, keepSteps, lastSheet, left, leftBehind, lookForTabs, takeUp } from "./keeping.js";
import { apart, sheet } from "./sheet.js";
import { connection, request } from "./socket.js";

const STEPS = 360; // positions of a run
const TYPING = 350; // ms of quiet before typed text is solved
const STOPPED = "The studio on this machine has stopped. Start it again and open its new address: your work is kept in this browser and offered there, on the same port.";
const STRANGER = "This browser is not let in yet. Open the address that `trunnion studio` printed.";

let link = { ask: async (_kind, _fields) => null }; // nobody, until this page is let in

/** Connect, read the program's examples and the opened folder, open what is to be opened. */
export function start() {
  return counted(begun());
}

async function begun() {
  const [reply] = await Promise.all([request("/files"), enterTab()]);
  if (reply.status === 403) return void (state.stopped.value = STRANGER);
  link = connection((open) => {
    state.connected.value = open;
    if (open) state.stopped.value = "";
    else request("/files").then(({ ok }) => (state.stopped.value = ok ? "" : STOPPED), () => (state.stopped.value = STOPPED)); // another token, or nobody there
    if (open && untracked(() => state.text.value)) solve();
  });
  const files = reply.ok ? await reply.json() : { folder: "", id: "", files: [], open: null };
  state.folder.value = { folder: files.folder, id: files.id, names: files.files };
  if (!sheets) await opened(files);
  if (!reply.ok) state.say("The folder could not be read.", true);
  state.waiting.value = leftBehind(files.files);
  keepSteps();
  effect(() => {
    state.friction.value; // another friction is another answer
    untracked(solve);
  });
  const about = await link.ask("start", {}); // not before the picture, for it takes the whole of Python
  if (about && !about.error) state.about.value = about;
}

/** What is to be opened first: the sheet of this tab, else that of the command line, else an empty one. */
async function opened(files) {
  const last = lastSheet();
  if (last && last.folder !== files.id) state.variant.value = null; // of another folder
  const again = last?.folder === files.id ? last.name : files.open;
  if (again && (files.open === again || files.files.includes(again))) await openFile(again);
  else openSheet({ name: null, saved: "", content: "" });
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
  const asked = { text: sent, steps: STEPS, friction: friction === "off" ? "off" : "stated" };
  const found = await link.ask("model", asked);
  if (!found || sent !== state.text.value) return;
  if (found.error) return state.say(found.error, true);
  const coming = found.solved ? figures(asked) : null; // Python works at them while the mechanism is drawn
  const read = Object.keys(found.numbers).length > 0; // else it is drawn by those that were there before the mistake
  const before = state.answer.value ?? { numbers: {}, figures: [] };
  state.answer.value = { ...found, numbers: read ? found.numbers : before.numbers, figures: before.figures ?? [], coming: found.solved, text: sent, friction: asked.friction };
  if (state.live.value?.text === null) state.live.value = null; // the dragged mechanism has its answer
  if (state.selection.value && !isPart(found, state.selection.value)) state.selection.value = null; // its name was undone, or it is gone
  if (found.scene && state.index.value >= found.scene.count) state.index.value = 0;
  await coming;
}

/** Ask for findings and figures of the whole cycle; one question at a time, for a long one would hold up the next. */
const figures = newest(
  (asked) => (asked.text === state.text.value ? link.ask("cycle", asked) : Promise.resolve(null)),
  (found, asked) => {
    const { text, friction } = state.answer.value ?? {};
    if (text !== asked.text || state.text.value !== asked.text || friction !== asked.friction) return;
    if (found.error) state.say(found.error, true);
    state.answer.value = { ...state.answer.value, ...(found.error ? {} : found), coming: false };
  },
);

let typing = 0;

/** Solve when nothing was typed for a while. */
function solveSoon() {
  clearTimeout(typing);
  typing = setTimeout(solve, TYPING);
}

/** Text and places of the mechanism as it is shown: what a gesture starts from. */
export function present() {
  const { scene } = state.answer.value ?? {};
  const fresh = state.solved.value && state.answer.value.text === state.text.value && !state.spatial.value;
  const places = fresh ? { ...state.places.value, ...placesAt(scene, posedAt(scene, state.index.value)) } : state.places.value;
  return { text: state.text.value, places };
}

/** @type {Promise<boolean>} */
let queue = Promise.resolve(true);

/**
 * Carry out gestures as one step to undo; one after the other, for each starts from what the one before left.
 * Steps in a row with the same `merge` are undone as one. `places`: what they start from, else what is shown. Whether it could be done.
 */
export function edit(gestures, merge = null, places = null) {
  if (gestures.some(({ to, by }) => to || by) && apart()) return Promise.resolve(false); // by a hand that sees it elsewhere
  queue = queue.then(() => carryOut(gestures, merge, places)).catch((problem) => refuse(String(problem.message ?? problem)));
  return counted(queue);
}

async function carryOut(gestures, merge, places) {
  const before = places ? { ...present(), places } : present();
  const done = await link.ask("edit", { ...before, gestures, fine: sheet.fine() });
  if (!done) return refuse("The connection was lost; the step was not carried out.");
  if (before.text !== state.text.value) return refuse("The model was changed meanwhile; the step was not carried out.");
  if (done.error) return refuse(done.error);
  state.commit(sentence(done.says, ""), before, done, merge);
  if (done.made?.[0] === "group") state.group.value = done.made[1].split(" ");
  else if (done.made) state.selection.value = { kind: done.made[0], name: done.made[1] };
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
  const [section, link, key] = path;
  const part = state.answer.value?.entries?.links?.[link] ?? {};
  const bare = section === "links" && key === "mass" && value !== null && !state.spatial.value && !("mass" in part) && !("centre" in part);
  return edit([{ do: "set", path, value }, ...(bare ? [{ do: "centre", link }] : [])], merge); // a first mass is in the middle
}

/** The mechanism with a point at another place ("drag") or other numbers ("try"); null where something newer was asked. */
export function changed(kind, fields) {
  const friction = state.friction.value === "off" ? "off" : "stated";
  return link.ask(kind, { text: state.text.value, steps: STEPS, friction, fine: sheet.fine(), ...fields });
}

/**
 * A function that asks about the newest of what it is called with, one question at a time, until the hand rests. An answer is shown,
 * `show(answer, asked)`, while Python works at the next.
 */
export function newest(ask, show) {
  let [wanted, working] = [null, null];
  const work = async () => {
    let last = () => {};
    while (wanted !== null) {
      const asked = wanted;
      wanted = null;
      const coming = ask(asked);
      last();
      const answer = await coming;
      last = () => answer && show(answer, asked);
    }
    working = null;
    last();
  };
  return (next) => {
    wanted = next;
    return (working ??= work());
  };
}

/** Ask something else of the mechanism that is shown; null where it has changed meanwhile or there is no answer. */
export async function askOf(kind, fields) {
  const { text, friction, scene } = state.answer.value;
  const found = await counted(link.ask(kind, { text, friction, steps: scene.count, ...fields }));
  if (found?.error) state.say(found.error, true);
  return found && !found.error && state.answer.value?.scene === scene ? found : null;
}

/** Take another text as a step to undo. */
export function takeText(content, name) {
  const before = present();
  state.commit(name, before, { ...before, text: content });
  state.say(`${name}.`);
  return solve();
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

let sheets = 0; // that were opened or asked for: the latest is the one that is shown

/**
 * Open a sheet with a text; its steps, and work that was left of it unsaved, are taken up again.
 */
export function openSheet({ name, saved, content }) {
  sheets += 1;
  const work = takeUp(name);
  const found = work && (name === null || work.text === saved || work.text !== work.saved) ? work : null;
  state.begin({ name, saved: name === null && found ? found.saved : saved, content: found?.text ?? content, steps: found });
  if (!state.text.value.trim()) state.answer.value = { text: state.text.value, entries: {}, numbers: {}, findings: [], ready: [], solved: false, scene: null };
  state.dialog.value = null;
  return solve();
}

/** Open the sheet that was left unsaved, or throw its work away. */
export async function takeWaiting(open) {
  const { name, key } = state.waiting.value;
  state.waiting.value = null;
  if (open) {
    await (name === null ? openSheet({ name: null, saved: "", content: "" }) : openFile(name));
    state.recovered.value = null; // it was asked for
    return;
  }
  forget(key);
}

/** Go back from the recovered work to the file as it was saved, as a step to undo. */
export function discard() {
  state.recovered.value = null;
  state.basis.value = state.savedText.value;
  return takeText(state.savedText.value, "Discard the recovered work");
}

export function openFile(name) {
  return counted(fetched(name));
}

async function fetched(name) {
  const mine = (sheets += 1);
  const leaves = mine > 1 && state.unsaved.value && state.fileName.value !== name ? state.fileName.value : undefined;
  const reply = await request(`/file/${encodeURIComponent(name)}`);
  await lookForTabs();
  if (!reply.ok) return state.say(`${name} could not be read.`, true);
  const { text } = await reply.json();
  if (mine !== sheets) return;
  const opened = openSheet({ name, saved: text, content: text });
  if (mine > 1) state.say(`${name} opened.`);
  if (leaves !== undefined) state.waiting.value = left(leaves);
  await opened;
}

/** A new sheet with a text that is in no file of the folder yet; work on a sheet without a name comes back by undo, that on a file as the file is opened. */
export function openText(content, words) {
  const file = state.unsaved.value ? state.fileName.value : null;
  const work = takeUp(null);
  const before = state.fileName.value === null && state.unsaved.value ? present() : work?.text !== work?.saved ? work : null;
  const step = before && { name: words, text: before.text, places: before.places ?? {} };
  forgetOwn(null);
  const opened = openSheet({ name: null, saved: content, content });
  if (step) state.past.value = [step];
  state.say(`${words}.${step ? " Undo brings the unsaved sheet back." : ""}${file ? ` Unsaved work on ${file} is kept: open it again.` : ""}`);
  return opened;
}

let pictures = Promise.resolve(); // one after another: of questions of a kind the latest alone is answered

/** The small picture of an example, {links, paths}. */
export const pictureOf = (name) => (pictures = pictures.then(() => link.ask("picture", { name })));

export function openExample(example) {
  return counted(shipped(example));
}

async function shipped({ name, title }) {
  const mine = (sheets += 1);
  const found = await link.ask("example", { name });
  if (!found || mine !== sheets) return;
  if (found.error) return state.say(found.error, true);
  await openText(found.text, `Example ${title || name} opened`);
}

/** Save under a name, or ask for one; `over`: another text that is there may be lost. {error, existing} where it was refused, else {}. */
export function save(name = state.fileName.value, over = false) {
  const gone = () => refused({ error: `${name} was not saved: the studio on this machine does not answer.` });
  if (name) return counted(stored(name, over).catch(gone));
  state.dialog.value = "save";
  return Promise.resolve({});
}

async function stored(name, over) {
  const content = state.text.value;
  const body = JSON.stringify({ text: content, opened: state.fileName.value, saved: state.basis.value, over });
  const reply = await request(`/file/${encodeURIComponent(name)}`, { method: "PUT", body });
  const told = await reply.json().catch(() => ({ error: `${name} could not be saved.` }));
  if (told.error) return refused(told);
  if (told.saved !== state.fileName.value) forgetOwn(state.fileName.value);
  state.fileName.value = told.saved;
  state.savedText.value = state.basis.value = content;
  state.recovered.value = null;
  state.dialog.value = null;
  const { names } = state.folder.value;
  state.folder.value = { ...state.folder.value, names: [...new Set([...names, told.saved])].sort() };
  state.say(`Saved as ${told.saved}.`);
  return {};
}

function refused(refusal) {
  const remedy = refusal.existing && !state.dialog.value ? " Replace it by File, Save as; save under another name; or open it again." : "";
  state.say(`${refusal.error}${remedy}`, true);
  return refusal;
}

/** Export and hand the file to the browser. */
export async function exported(what) {
  state.say(`${what.toUpperCase()} is being made …`);
  const made = await counted(link.ask("export", { text: state.text.value, what, steps: STEPS, index: state.index.value }));
  if (!made) return;
  if (made.error) return state.say(made.error, true);
  const [first, count] = made.bytes.bytes;
  const ending = made.name.split(".").pop();
  handOver(`${stemOf(state.answer.value.entries, state.fileName.value)}.${ending}`, new Blob([made.body.slice(first, first + count)], { type: made.mime }));
}

function handOver(name, blob) {
  const address = URL.createObjectURL(blob);
  const anchor = Object.assign(document.createElement("a"), { href: address, download: name });
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
  state.say(`${name} exported.`);
}
