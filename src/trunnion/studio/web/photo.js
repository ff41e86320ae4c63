// A photo or drawing behind the grid: calibrated by two points and their distance, kept by the browser with the work.

import { effect, signal, untracked } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { set, svg } from "../web/dom.js";
import { numberOf, plainNumber } from "./fields.js";
import { enlarged, lengthOf, lengthText, lengthUnit } from "./geometry.js";
import { keyOf } from "./keeping.js";
import { sheet } from "./sheet.js";
import * as state from "./state.js";
import { Button, focusOn, html } from "./ui.js";

const LARGEST = 2400; // px that are kept along a side
const STORE = "photos";

/** @typedef {{image: Blob, width: number, height: number, x: number, y: number, pixel: number, turn?: number, opacity: number}} Photo
 *  of an upper left corner at x, y (m), pixels of so many m, turned by so much, rad */

/** Address of the shown image, made of its blob. */
const address = signal("");
/** Points that are being clicked: {for: "scale" | "move", points}, or null. */
const picking = signal(null);
/** Whether its card is open. */
export const photoCard = signal(false);

// ---- kept with the work -----------------------------------------------------------------------------------------

/** @returns {Promise<IDBObjectStore>} */
function store() {
  return new Promise((resolve, reject) => {
    const asked = indexedDB.open("trunnion studio", 1);
    asked.onupgradeneeded = () => asked.result.createObjectStore(STORE);
    asked.onsuccess = () => resolve(asked.result.transaction(STORE, "readwrite").objectStore(STORE));
    asked.onerror = () => reject(asked.error);
  });
}

/** @returns {Promise<any>} */
function settled(/** @type {IDBRequest} */ asked) {
  return new Promise((resolve, reject) => {
    asked.onsuccess = () => resolve(asked.result);
    asked.onerror = () => reject(asked.error);
  });
}

/** The photo of a sheet is no longer kept. */
export async function forgetPhoto(/** @type {string | null} */ name) {
  const key = keyOf(name);
  await store().then((photos) => settled(photos.delete(key))).catch(() => {}); // storage is off: none was kept
}

/** Take up the photo of every sheet that is opened, and keep each change of it. */
export function keepPhotos() {
  effect(() => {
    const mine = state.opened.value;
    const key = untracked(() => keyOf(state.fileName.value));
    picking.value = null;
    store().then((photos) => settled(photos.get(key))).catch(() => null).then((found) => {
      if (mine === state.opened.value && state.photo.value === undefined) state.photo.value = found ?? null;
    });
  });
  effect(() => {
    const photo = state.photo.value;
    const key = keyOf(state.fileName.value);
    if (photo === undefined) return; // not known yet
    store().then((photos) => settled(photo ? photos.put(photo, key) : photos.delete(key))).catch(() => photo && state.say("The browser has no room for the picture: it is lost when the page is closed.", true));
  });
  effect(() => {
    const image = state.photo.value?.image;
    untracked(() => address.value && URL.revokeObjectURL(address.value));
    address.value = image ? URL.createObjectURL(image) : "";
  });
}

// ---- taken from a file ------------------------------------------------------------------------------------------

async function take(/** @type {File} */ file) {
  const url = URL.createObjectURL(file);
  try {
    const image = new Image();
    image.src = url;
    await image.decode();
    const factor = Math.min(1, LARGEST / Math.max(image.naturalWidth, image.naturalHeight));
    const [width, height] = [image.naturalWidth, image.naturalHeight].map((side) => Math.max(Math.round(factor * side), 1));
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    canvas.getContext("2d").drawImage(image, 0, 0, width, height);
    const kept = await new Promise((resolve) => canvas.toBlob(resolve, "image/webp", 0.88));
    const { frame } = sheet.view;
    const pixel = (0.9 / frame.scale) * Math.min(frame.width / width, frame.height / height);
    const [x, y] = frame.from([frame.width / 2, frame.height / 2]);
    state.photo.value = { image: kept, width, height, pixel, x: x - (pixel * width) / 2, y: y + (pixel * height) / 2, opacity: 0.5 };
    state.say(`${file.name} lies behind the grid. Give its scale by two points.`);
  } catch {
    state.say(`${file.name} is no picture that the browser can show; use PNG, JPEG, WebP or SVG.`, true);
  } finally {
    URL.revokeObjectURL(url);
  }
}

// ---- where it lies ----------------------------------------------------------------------------------------------

function change(fields) {
  state.photo.value = { ...state.photo.value, ...fields };
}

/** Show it, and let points of it be clicked; returns what ends this. */
export function watchPhoto(view) {
  const node = svg("image", { preserveAspectRatio: "none" });
  const marks = svg("g", { class: "marks" });
  view.root.append(marks);
  const pose = () => {
    const photo = state.photo.value;
    view.layers.photo.replaceChildren(...(photo && address.value ? [node] : []));
    if (photo) {
      const { scale, to } = view.frame;
      const [x, y] = to([photo.x, photo.y]);
      const side = scale * photo.pixel;
      const turned = `translate(${x},${y}) rotate(${(-180 / Math.PI) * (photo.turn ?? 0)})`;
      set(node, { href: address.value, transform: turned, width: side * photo.width, height: side * photo.height, opacity: photo.opacity });
    }
    const spots = (picking.value?.points ?? []).map(view.frame.to);
    marks.replaceChildren(...spots.map(([x, y]) => svg("path", { class: "cross", d: `M${x - 9},${y}h18M${x},${y - 9}v18` })));
  };
  const click = (event) => {
    if (!picking.value || event.button !== 0) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    if (event.type !== "pointerdown" || picking.value.points.length > 1) return;
    const box = view.root.getBoundingClientRect();
    pick(view.frame.from([event.clientX - box.left, event.clientY - box.top]));
  };
  const kinds = ["pointerdown", "pointerup"];
  kinds.forEach((kind) => view.root.addEventListener(kind, click, true));
  sheet.photo = pose;
  const stop = effect(pose);
  return () => {
    stop();
    sheet.photo = () => {};
    kinds.forEach((kind) => view.root.removeEventListener(kind, click, true));
  };
}

function pick(at) {
  const points = [...picking.value.points, at];
  if (picking.value.for === "move" && points.length === 2) {
    const [from, to] = points;
    change({ x: state.photo.value.x + to[0] - from[0], y: state.photo.value.y + to[1] - from[1] });
    picking.value = null;
  } else picking.value = { ...picking.value, points };
}

// ---- its card ---------------------------------------------------------------------------------------------------

const NEXT = {
  scale: ["Click one point of the picture.", "Click another point whose distance is known."],
  move: ["Click a point of the picture.", "Click where it belongs."],
};

/** Choose, place and fade the picture. */
export function PhotoCard() {
  const photo = state.photo.value;
  if (!photoCard.value || state.spatial.value) return null;
  const close = () => {
    picking.value = null;
    photoCard.value = false;
  };
  return html`<section class="photo-card" aria-label="Picture behind the grid">
    <h2>Picture behind the grid</h2>
    <label class="choice">${photo ? "Another" : "Photo or drawing"} <input type="file" accept="image/*" onChange=${({ target }) => target.files[0] && take(target.files[0])} /></label>
    ${photo && html`<${Placing} photo=${photo} />`}
    <p class="row-of-buttons end">${photo && html`<${Button} label="Remove" onClick=${() => (state.photo.value = null)} />`} <${Button} label="Close" onClick=${close} /></p>
  </section>`; // prettier-ignore
}

function Placing({ photo }) {
  const now = picking.value;
  const unit = lengthUnit(sheet.view ? sheet.view.frame.width / sheet.view.frame.scale : 1);
  const begin = (what) => (picking.value = { for: what, points: [] });
  const width = photo.width * photo.pixel;
  const whole = (typed) => {
    const length = lengthOf(typed, unit);
    if (length) change(enlarged(photo, [photo.x, photo.y], length / width));
    else state.say(`“${typed}” is no length; type one as 60, 60 mm or 2.5 in.`, true);
  };
  return html`<label class="choice">Opacity <input type="range" min="0.1" max="1" step="0.05" value=${photo.opacity} onInput=${({ target }) => change({ opacity: Number(target.value) })} /></label>
    <label class="choice">Width of it all <input value=${lengthText(width, unit, width / 1000)} onChange=${({ target }) => whole(target.value)} /></label>
    <p class="row-of-buttons"><${Button} label="Scale by two points" pressed=${now?.for === "scale"} onClick=${() => begin("scale")} /> <${Button} label="Move" pressed=${now?.for === "move"} onClick=${() => begin("move")} /></p>
    ${now && now.points.length < 2 && html`<p class="calm" role="status">${NEXT[now.for][now.points.length]}</p>`}
    ${now?.points.length === 2 && html`<${Distance} unit=${unit} />`}`; // prettier-ignore
}

function Distance({ unit }) {
  const [typed, setTyped] = useState("");
  const [way, setWay] = useState("");
  const [wrong, setWrong] = useState("");
  useEffect(() => focusOn(".photo-card form input"), []);
  const submit = (event) => {
    event.preventDefault();
    const [a, b] = picking.value.points;
    const [length, shown] = [lengthOf(typed, unit), Math.hypot(b[0] - a[0], b[1] - a[1])];
    if (!length) return setWrong(`“${typed}” is no length; type one as 60, 60 mm or 2.5 in.`);
    const angle = way.trim() ? numberOf(plainNumber(way.replace(/°|deg/, ""))) : { value: null, rest: "" };
    if (!angle || angle.rest) return setWrong(`“${way}” is no angle; type one as 90, or leave it open.`);
    picking.value = null;
    if (!shown) return state.say("The two points are one; click two that lie apart.", true);
    const by = angle.value === null ? 0 : (angle.value * Math.PI) / 180 - Math.atan2(b[1] - a[1], b[0] - a[0]);
    change(enlarged(state.photo.value, a, length / shown, by));
    const turned = angle.value === null ? "" : `, the second at ${angle.value}° from the first`;
    state.say(`The picture has its scale: the two points are ${lengthText(length, unit, length / 1000)} apart${turned}.`);
  };
  return html`<form onSubmit=${submit}><label class="choice">Distance between them <input value=${typed} placeholder=${`60 ${unit}`} onInput=${({ target }) => setTyped(target.value)} /></label>
    <label class="choice">Angle of the second (optional) <input value=${way} placeholder="90°" onInput=${({ target }) => setWay(target.value)} /></label>
    <p class="wrong" role="alert">${wrong}</p>
    <p class="row-of-buttons"><button type="submit" class="plain strong">Take it</button></p></form>`; // prettier-ignore
}
