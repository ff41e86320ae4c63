// Dialogs: files of the folder, saving under a name; files that are dropped.

import { useEffect, useRef, useState } from "preact/hooks";
import { openFile, openText, save } from "./actions.js";
import { Examples } from "./gallery.js";
import { stemOf } from "./geometry.js";
import { Keys } from "./keysheet.js";
import { request } from "./socket.js";
import * as state from "./state.js";
import { Studies } from "./studies.js";
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
