// The examples with their pictures, drawn of links and paths as Python places them; only of those that come into sight.

import { useEffect, useRef, useState } from "preact/hooks";
import { hull } from "../web/data.js";
import { openExample, pictureOf } from "./actions.js";
import * as state from "./state.js";
import { html } from "./ui.js";

const [WIDE, HIGH, EDGE] = [168, 112, 12];

/** Pictures by the names of their examples, as promises: each is fetched once. */
const pictures = new Map();

export function Examples() {
  const [wanted, setWanted] = useState("");
  const fits = ({ name, title }) => `${name} ${title}`.toLowerCase().includes(wanted.toLowerCase());
  const found = state.about.value.examples.filter(fits);
  return html`<h2>Examples</h2>
    <input type="search" aria-label="Search the examples" placeholder="Search" value=${wanted} onInput=${(event) => setWanted(event.target.value)} autofocus />
    <ul class="gallery">
      ${found.map((one) => html`<li key=${one.name}><button type="button" class="card" onClick=${() => openExample(one)}>
        <${Picture} name=${one.name} /><span>${one.title || one.name}</span><span class="of">${one.space === "spatial" ? "in space" : "planar"}</span></button></li>`)}
    </ul>
    ${!found.length && html`<p class="calm">No example has these words.</p>`}`; // prettier-ignore
}

export function Picture({ name }) {
  const holder = useRef(null);
  const [shown, setShown] = useState(null);
  useEffect(() => {
    const watch = new IntersectionObserver(async ([{ isIntersecting }]) => {
      if (!isIntersecting) return;
      watch.disconnect();
      if (!pictures.has(name)) pictures.set(name, fetched(name));
      setShown(await pictures.get(name));
    });
    watch.observe(holder.current);
    return () => watch.disconnect();
  }, [name]);
  return html`<svg ref=${holder} class="thumbnail" viewBox=${`0 0 ${WIDE} ${HIGH}`} aria-hidden="true">
    ${shown && (shown.links.length ? parts(shown) : html`<text x=${WIDE / 2} y=${HIGH / 2}>no picture</text>`)}
  </svg>`;
}

async function fetched(name) {
  const found = await pictureOf(name);
  return found && !found.error ? found : { links: [], paths: [] };
}

/** Paths below, links as the hulls of their points, a dot at each point. */
function parts({ links, paths }) {
  const spots = [...links.flatMap(({ points }) => points), ...paths.flatMap(({ x, y }) => x.map((value, k) => [value, y[k]]))];
  const ends = [0, 1].map((axis) => spots.map((spot) => spot[axis]).reduce(([low, high], one) => [Math.min(low, one), Math.max(high, one)], [Infinity, -Infinity]));
  const [[left, right], [low, high]] = ends;
  const scale = Math.min((WIDE - 2 * EDGE) / (right - left || 1), (HIGH - 2 * EDGE) / (high - low || 1));
  const to = ([x, y]) => [WIDE / 2 + scale * (x - (left + right) / 2), HIGH / 2 - scale * (y - (low + high) / 2)];
  const line = (points) => points.map((spot) => spot.map((part) => part.toFixed(1)).join()).join("L");
  const moving = links.filter(({ ground, points }) => !ground && points.length > 1);
  return html`${paths.map(({ x, y }) => html`<path class="path" d=${`M${line(x.map((value, k) => to([value, y[k]])))}`} />`)}
    ${moving.map(({ points }, order) => html`<path class=${`body k${order % 6}`} d=${`M${line(hull(points.map(to)))}Z`} />`)}
    ${links.flatMap(({ ground, points }) => points.map(to).map(([x, y]) => html`<circle class=${ground ? "pin ground" : "pin"} cx=${x} cy=${y} r=${ground ? 3.4 : 2.4} />`))}`;
}
