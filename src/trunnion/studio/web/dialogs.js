// Dialogs: examples, files of the folder, saving under a name; files that are dropped.

import { useEffect, useRef, useState } from "preact/hooks";
import { openExample, openFile, openText, save } from "./actions.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

export function Dialogs() {
  const name = state.dialog.value;
  if (!name) return null;
  const Body = { examples: Examples, open: Open, save: Save }[name];
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

function Examples() {
  const [wanted, setWanted] = useState("");
  const fits = ({ name, title }) => `${name} ${title}`.toLowerCase().includes(wanted.toLowerCase());
  return html`<h2>Examples</h2>
    <input type="search" aria-label="Search the examples" placeholder="Search" value=${wanted} onInput=${(event) => setWanted(event.target.value)} autofocus />
    <ul class="list">
      ${state.about.value.examples.filter(fits).map((one) => html`<li><button type="button" class="plain wide" onClick=${() => openExample(one)}>
        <span>${one.title || one.name}</span><span class="of">${one.space === "spatial" ? "in space" : "planar"}</span></button></li>`)}
    </ul>`; // prettier-ignore
}

function Open() {
  const { folder, names } = state.folder.value;
  const take = async ({ target }) => target.files[0] && openText(await target.files[0].text(), `${target.files[0].name} opened`);
  return html`<h2>Open</h2>
    <p class="calm">${folder}</p>
    <ul class="list">${names.map((name) => html`<li><button type="button" class="plain wide" onClick=${() => openFile(name)}>${name}</button></li>`)}</ul>
    <label class="choice">A file from elsewhere <input type="file" accept=".yaml,.yml,.json,.txt" onChange=${take} /></label>`; // prettier-ignore
}

function Save() {
  const [name, setName] = useState(state.fileName.value ?? "mechanism.yaml");
  const known = state.folder.value.names.includes(name) && name !== state.fileName.value;
  const submit = (event) => {
    event.preventDefault();
    save(/\.\w+$/.test(name) ? name : `${name}.yaml`);
  };
  return html`<form onSubmit=${submit}>
    <h2>Save as</h2>
    <label class="choice">Name <input value=${name} onInput=${(event) => setName(event.target.value)} required autofocus /></label>
    <p class="calm">In ${state.folder.value.folder}${known ? html` — <b>a file of this name is there and will be replaced</b>` : ""}</p>
    <p class="row-of-buttons end"><button type="submit" class="plain strong">Save</button></p>
  </form>`;
}

/** Files dropped on the page are opened. */
export function listenToDrops(target) {
  target.addEventListener("dragover", (event) => event.preventDefault());
  target.addEventListener("drop", async (event) => {
    event.preventDefault();
    const [file] = event.dataTransfer.files;
    if (file) openText(await file.text(), `${file.name} opened`);
  });
}
