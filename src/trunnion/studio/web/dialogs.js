// Dialogs: files of the folder, saving under a name; files that are dropped.

import { useEffect, useRef, useState } from "preact/hooks";
import { openFile, openText, save } from "./actions.js";
import { Examples } from "./gallery.js";
import { stemOf } from "./geometry.js";
import { request } from "./socket.js";
import * as state from "./state.js";
import { Studies } from "./studies.js";
import { TOOLS } from "./tools.js";
import { Button, html } from "./ui.js";

const NO_REFUSAL = { error: "", existing: "" };

export function Dialogs() {
  const name = state.dialog.value;
  if (!name) return null;
  const Body = { examples: Examples, keys: Keys, open: Open, save: Save, studies: Studies }[name];
  return html`<${Frame} key=${name}><${Body} /><//>`;
}

function Frame({ children }) {
  const element = useRef(null);
  useEffect(() => element.current.showModal(), []);
  const close = () => (state.dialog.value = null);
  return html`<dialog ref=${element} onClose=${close} onClick=${(event) => event.target === element.current && close()}>
    ${children}<p class="row-of-buttons end"><${Button} label="Close" onClick=${close} /></p>
  </dialog>`;
}

function Open() {
  const { folder, names } = state.folder.value;
  const take = ({ target }) => target.files[0] && openDropped(target.files[0]);
  return html`<h2>Open</h2>
    <p class="calm">${folder}</p>
    <ul class="list">${names.map((name) => html`<li><button type="button" class="plain wide" onClick=${() => openFile(name)}>${name}</button></li>`)}</ul>
    <label class="choice">A file from elsewhere <input type="file" onChange=${take} /></label>`; // prettier-ignore
}

function Save() {
  const [name, setName] = useState(state.fileName.value ?? `${stemOf(state.answer.value?.entries)}.yaml`);
  const [refusal, setRefusal] = useState(NO_REFUSAL);
  const put = async (over) => setRefusal(await save(name, over));
  const submit = (event) => {
    event.preventDefault();
    return put(false);
  };
  const type = ({ target }) => {
    setName(target.value);
    setRefusal(NO_REFUSAL);
  };
  return html`<form onSubmit=${submit}>
    <h2>Save as</h2>
    <label class="choice wide-choice">Name <input value=${name} onInput=${type} onFocus=${({ target }) => target.select()} required autofocus /></label>
    <p class="calm">In ${state.folder.value.folder}</p>
    <p class="wrong" role="alert">${refusal.error}</p>
    <p class="row-of-buttons end">${refusal.existing && html`<${Button} label=${`Replace ${refusal.existing}`} onClick=${() => put(true)} />`}<button type="submit" class="plain strong">Save</button></p>
  </form>`; // prettier-ignore
}

/** Open a model from elsewhere. */
async function openDropped(file) {
  if (/\.(ya?ml|json|txt)$/i.test(file.name)) return openText(await file.text(), `${file.name} opened`);
  const reply = await request(`/import/${encodeURIComponent(file.name)}`, { method: "PUT", body: await file.arrayBuffer() });
  const told = await reply.json().catch(() => ({ error: `${file.name} could not be read.` }));
  if (told.error) return state.say(told.error, true);
  await openText(told.text, `${file.name} imported`);
  state.say(`${file.name} imported. ${told.says.length ? `To look at: ${told.says.slice(0, 3).join("; ")}${told.says.length > 3 ? ` and ${told.says.length - 3} more` : ""}.` : ""}`);
}

/** Files dropped on the page are opened. */
export function listenToDrops(target) {
  target.addEventListener("dragover", (event) => event.preventDefault());
  target.addEventListener("drop", (event) => {
    event.preventDefault();
    const [file] = event.dataTransfer.files;
    if (file) openDropped(file);
  });
}

// ---- keys ----------------------------------------------------------------------------------------------------------

/** @type {[string, string[][]][]} */
const KEYS = [
  ["Tools", TOOLS.map(({ key, label }) => [key, label])],
  [
    "On the sheet (Tab brings it, its links and joints into focus)",
    [
      ["← → ↑ ↓", "move the cross by a step of the grid, with Shift ten, with Alt a tenth; a joint in focus moves"],
      ["Enter", "use the tool at the cross, joint or link; with Select, open its properties"],
      ["Shift Enter", "draw an end and pin it to the ground"],
      ["0–9 …", "while drawing: a length, angle, force or ratio, then Enter"],
      ["Delete", "delete what is chosen"],
      ["Menu, Shift F10", "what can be done with the joint, the link or the place"],
      ["Ctrl A, Shift click", "choose all links, or one more; arrows move them"],
      ["Ctrl D", "copy what is chosen"],
      ["Escape", "leave off what was begun"],
    ],
  ],
  ["In space (Tab goes through joints, points and links)", [["Enter", "choose it and open its properties"], ["← → ↑ ↓", "move a joint along the axes nearest to them, with Shift ten steps, with Alt a tenth"], ["Page Up, Page Down", "move it away or nearer"]]],
  ["Motion", [["Space", "play or pause"], [", .", "one position back or on; ← → on a curve, with Shift ten"]]],
  ["View", [["+ −", "zoom"], ["0", "show all"]]],
  ["Everywhere", [["Ctrl Z, Ctrl Shift Z", "undo, redo"], ["Ctrl S, Ctrl O", "save, open"], ["↓ ↑", "go through an open menu"], ["?", "this list"]]],
]; // prettier-ignore

function Keys() {
  return html`<h2>Keys</h2>
    <div class="key-list">${KEYS.map(
      ([title, rows]) => html`<section><h3>${title}</h3><dl>${rows.map(([keys, does]) => html`<dt><kbd>${keys}</kbd></dt><dd>${does}</dd>`)}</dl></section>`,
    )}</div>`;
}
