// Masses: the mark of each mass centre on the sheet, which can be dragged, the table of all links, and gravity.

import { useState } from "preact/hooks";
import { angleAt, place } from "../web/data.js";
import { stated } from "../web/format.js";
import { set, svg } from "../web/dom.js";
import { changed, edit, newest, setValue } from "./actions.js";
import { dictionary, groundOf } from "./geometry.js";
import { sheet, shown } from "./sheet.js";
import * as state from "./state.js";
import { Button, html } from "./ui.js";

const RADIUS = 6.5; // px of the mark
const CROWD = 60; // masses, of which those of links shorter than their mark are left out until the drawing is larger

/** Where the centre of a link is while it is dragged, {link, local} m in the frame of the link; or null. */
let pulled = null;

/** A place in the frame of a link, by its coordinates or by distance and angle. */
function localOf(numbers, path) {
  const { [`${path}.distance`]: far, [`${path}.angle`]: turn, [`${path}.x`]: x = 0, [`${path}.y`]: y = 0 } = numbers;
  return far === undefined ? [x, y] : [far * Math.cos(turn ?? 0), far * Math.sin(turn ?? 0)];
}

/** The frame of a link at the shown position, {origin, angle}; null where it has no place. */
function frameOf({ scene, drawn }, numbers, link) {
  const key = link?.points.find((one) => place(scene, one, drawn));
  if (!key) return null;
  const angle = angleAt(link.angle, drawn) ?? 0;
  const [x, y] = turned(localOf(numbers, `links.${link.name}.points.${key.slice(link.name.length + 1)}`), angle);
  const spot = place(scene, key, drawn);
  return { origin: [spot[0] - x, spot[1] - y], angle };
}

function turned(/** @type {number[]} */ [x, y], angle) {
  return [x * Math.cos(angle) - y * Math.sin(angle), x * Math.sin(angle) + y * Math.cos(angle)];
}

/** The mass centres of the moving links that have a mass, as what a hand can take: [{kind, name, key, at, mass}]. */
export function massSpots(view) {
  const { numbers = {}, entries } = state.answer.peek() ?? {};
  if (!state.layers.peek().masses || !view.scene || view.ideal || state.spatial.peek()) return []; // errors drawn larger move them
  const heavy = view.scene.links.filter(({ name, ground }) => !ground && name !== groundOf(entries) && numbers[`links.${name}.mass`] > 0);
  const long = ({ points }) => {
    const [a, b] = points.map((key) => place(view.scene, key, view.drawn)).filter(Boolean);
    return !b || Math.hypot(a[0] - b[0], a[1] - b[1]) * view.frame.scale > 2 * RADIUS;
  };
  return heavy.flatMap((link) => {
    const { name } = link;
    const frame = heavy.length <= CROWD || long(link) ? frameOf(view, numbers, link) : null;
    if (!frame) return [];
    const [x, y] = turned(pulled?.link === name ? pulled.local : localOf(numbers, `links.${name}.centre`), frame.angle);
    return { kind: "centres", name, key: name, at: [frame.origin[0] + x, frame.origin[1] + y], mass: numbers[`links.${name}.mass`] };
  });
}

/** Put the marks over such spots: circles with two quarters filled. */
export function poseMasses({ layers, frame }, spots) {
  const r = RADIUS;
  const mark = () => svg("g", { class: "mass-centre" }, svg("circle", { r }), svg("path", { d: `M0,0V${-r}A${r},${r} 0 0 1 ${r},0ZM0,0V${r}A${r},${r} 0 0 1 ${-r},0Z` }));
  if (layers.masses.childElementCount !== spots.length) layers.masses.replaceChildren(...spots.map(mark));
  spots.forEach(({ name, at }, order) => {
    const [x, y] = frame.to(at).map((part) => part.toFixed(1));
    set(layers.masses.children[order], { transform: `translate(${x},${y})`, "data-of": name });
  });
}

/** What a part under the pointer stands for: a mass centre for its link. */
export function chosenOf(part) {
  return part && { kind: part.kind === "centres" ? "links" : part.kind, name: part.name };
}

/** A mass centre in the hand: `to(place)` shows forces with it there, `drop()` writes it, `leave()` puts it back. */
export function centreHeld(view, link) {
  const { numbers } = state.answer.peek();
  const frame = frameOf(view, numbers, view.scene.links.find(({ name }) => name === link));
  const path = `links.${link}.centre`;
  const [text, index] = [state.text.peek(), state.index.peek()];
  const whole = !shown.peek()?.sketched;
  const ask = newest((values) => changed("try", { values, index }), (found) => {
    if (pulled && text === state.text.peek()) found.error ? state.say(found.error, true) : (state.live.value = found);
  }); // prettier-ignore
  let [at, asked] = [null, null];
  state.selection.value = { kind: "links", name: link };
  return {
    to(place) {
      at = place;
      const local = turned([place[0] - frame.origin[0], place[1] - frame.origin[1]], -frame.angle);
      pulled = { link, local };
      const polar = `${path}.distance` in numbers;
      const parts = polar ? [Math.hypot(...local), Math.atan2(local[1], local[0])] : local;
      state.say(`Mass centre of ${link} at ${local.map((one) => stated(Math.abs(one) < sheet.fine() ? 0 : one, "m")).join(", ")} in its frame.`);
      if (whole) asked = ask(Object.fromEntries((polar ? ["distance", "angle"] : ["x", "y"]).map((key, order) => [`${path}.${key}`, parts[order]])));
      sheet.after();
    },
    async drop() {
      await asked;
      if (at) await edit([{ do: "centre", link, at }]);
      this.leave();
    },
    leave() {
      pulled = null;
      state.live.value = null;
      sheet.after();
    },
  };
}

const inertiaOf = (value) => (value < 0.1 ? stated(1e6 * value, "kg\u00a0mm²") : stated(value, "kg\u00a0m²"));

/** Mass, centre and inertia of all moving links, as they are by now. */
export function Masses() {
  const { entries, numbers = {} } = state.answer.value ?? {};
  const links = Object.keys(dictionary(entries?.links)).filter((name) => name !== groundOf(entries));
  if (!links.length || state.spatial.value) return null;
  const mass = (name) => numbers[`links.${name}.mass`] ?? 0;
  const row = (name) => [
    stated(mass(name), "kg"),
    localOf(numbers, `links.${name}.centre`).map((one) => stated(one, "m")).join(", ").replace(/\b0\u00a0m\b/g, "0"),
    inertiaOf(numbers[`links.${name}.inertia`] ?? 0),
  ]; // prettier-ignore
  const total = links.reduce((sum, name) => sum + mass(name), 0);
  return html`<section class="mass-table"><h2>Masses</h2>
    <table><thead><tr><th>Link</th><th>Mass</th><th>Centre in its frame</th><th>Inertia about it</th></tr></thead>
      <tbody>${links.map((name) => html`<tr key=${name}><th><button type="button" class="link" onClick=${() => (state.selection.value = { kind: "links", name })}>${name}</button></th>
        ${mass(name) > 0 ? row(name).map((cell) => html`<td>${cell}</td>`) : html`<td colspan="3">none stated</td>`}</tr>`)}
        ${total > 0 && html`<tr><th>all</th><td>${stated(total, "kg")}</td><td colspan="2"></td></tr>`}</tbody></table>
    <${BarMass} links=${links.filter((name) => !(mass(name) > 0))} />
    <${Gravity} /></section>`; // prettier-ignore
}

/** Gravity, where there are masses and nothing is said of it. */
export function Gravity() {
  const { entries, numbers = {} } = state.answer.value ?? {};
  const heavy = Object.keys(numbers).some((path) => /^links\..*\.mass$/.test(path) && numbers[path] > 0);
  if (!heavy || entries?.gravity !== undefined || state.spatial.value) return null;
  return html`<p class="row-of-buttons"><${Button} label="Add gravity, 9.81 m/s² downwards" onClick=${() => setValue(["gravity"], ["0 m/s^2", "-9.81 m/s^2"])} /></p>`;
}

/** Mass, centre and inertia of flat bars by their section and density. */
export function BarMass({ links }) {
  const [typed, setTyped] = useState({ width: "20 mm", thickness: "10 mm", density: "7850 kg/m^3" });
  const put = (key) => ({ target }) => setTyped({ ...typed, [key]: target.value });
  const points = (name) => Object.keys(dictionary(state.answer.value?.entries?.links?.[name]?.points)).length;
  const bars = links.filter((name) => points(name) > 1 && !isBlock(name));
  if (!bars.length) return null;
  const label = bars.length > 1 ? `Set mass, centre and inertia of ${bars.length} links` : "Set mass, centre and inertia";
  return html`<details class="bar-mass"><summary>Mass of ${bars.length > 1 ? "flat bars" : "a flat bar"}${links.length > 1 && bars.length === 1 ? `: ${bars[0]}` : ""}</summary>
    ${Object.keys(typed).map((key) => html`<label class="choice">${key} <input aria-label=${key} value=${typed[key]} onInput=${put(key)} /></label>`)}
    <${Button} label=${label} onClick=${() => edit(bars.map((link) => ({ do: "bar-mass", link, ...typed })))} /></details>`; // prettier-ignore
}

/** Whether all points of a link lie on one spot. */
function isBlock(name) {
  const { entries, numbers = {} } = state.answer.value ?? {};
  const spots = Object.keys(dictionary(entries?.links?.[name]?.points)).map((point) => localOf(numbers, `links.${name}.points.${point}`));
  return spots.every(([x, y]) => x === spots[0][0] && y === spots[0][1]);
}
