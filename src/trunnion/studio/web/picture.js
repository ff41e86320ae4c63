// The sheet as a picture of its own: the position and the layers as they are shown, in the colours they have.

import { say } from "../web/data.js";
import { svg } from "../web/dom.js";
import { stemOf } from "./geometry.js";
import { sheet } from "./sheet.js";
import * as state from "./state.js";

const DRAWN = [
  "fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "stroke-linejoin", "stroke-opacity", "opacity", "visibility",
  "display", "paint-order", "font-family", "font-size", "font-weight", "font-style", "text-anchor", "dominant-baseline", "vector-effect", "filter",
]; // prettier-ignore
const TOOLS = ".handles, .tools"; // for the hand alone
const DENSE = 2; // dots of a PNG for a pixel

/** The sheet as {name, blob}; kind: "svg" or "png". */
export async function pictureOf(kind) {
  const { svg: drawn, name } = await sheetAlone();
  const blob = new Blob([new XMLSerializer().serializeToString(drawn)], { type: "image/svg+xml" });
  return { name: `${name}.${kind}`, blob: kind === "svg" ? blob : await dots(blob, sheet.view.frame) };
}

/** A copy of the sheet that needs no style sheet, with the position in words. */
async function sheetAlone() {
  const { root, frame } = sheet.view;
  const copy = /** @type {SVGElement} */ (root.cloneNode(true));
  const [from, to] = [root, copy].map((one) => [one, ...one.querySelectorAll("*")]);
  const paper = getComputedStyle(document.body).backgroundColor;
  from.forEach((one, order) => {
    const style = getComputedStyle(one);
    to[order].setAttribute("style", DRAWN.map((key) => `${key}:${style.getPropertyValue(key)}`).join(";"));
  });
  copy.querySelectorAll(TOOLS).forEach((one) => one.remove());
  const photo = state.photo.value?.image;
  for (const image of copy.querySelectorAll("image")) image.setAttribute("href", photo ? await dataOf(photo) : "");
  const { scene } = state.answer.value;
  const ink = getComputedStyle(root).color;
  copy.prepend(svg("rect", { width: frame.width, height: frame.height, fill: paper }));
  const words = say(scene, state.index.value);
  if (scene.count > 1) copy.append(svg("text", { x: 16, y: 26, fill: ink, "font-family": "sans-serif", "font-size": 14 }, `${scene.abscissa.label} ${words}`));
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", String(frame.width));
  copy.setAttribute("height", String(frame.height));
  return { svg: copy, name: stemOf(state.answer.value.entries, state.fileName.value) };
}

/** A picture as dots, twice as many as the sheet has. */
async function dots(blob, { width, height }) {
  const address = URL.createObjectURL(blob);
  const image = new Image(width, height);
  image.src = address;
  await image.decode();
  URL.revokeObjectURL(address);
  const canvas = Object.assign(document.createElement("canvas"), { width: DENSE * width, height: DENSE * height });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return /** @type {Promise<Blob>} */ (new Promise((resolve) => canvas.toBlob(resolve, "image/png")));
}

/** A file as an address that holds it. */
function dataOf(blob) {
  const reader = new FileReader();
  const told = new Promise((resolve) => (reader.onload = () => resolve(reader.result)));
  reader.readAsDataURL(blob);
  return told;
}
