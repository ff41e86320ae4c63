// The numbers of a plot as a table beside it: pointing at a row moves the mechanism, and the mechanism moves the row.

import { html, set } from "../web/dom.js";
import { fixed } from "../web/format.js";

const STRIDES = { ArrowUp: -1, ArrowDown: 1, PageUp: -10, PageDown: 10, Home: -Infinity, End: Infinity };

/** Titles of the plots whose tables are open, so that they stay so. */
const open = new Set();

/**
 * A chart {element, show, scale, most} with a button that opens its table. `columns` [{label, values}] are in the unit of
 * the chart before its prefix, `pick(index, firm)` moves the mechanism.
 */
export function tabled(chart, { scene, title, columns, pick }) {
  const { element, show } = chart;
  const held = { rows: [], index: 0, box: null };
  const button = html("button", { type: "button", class: "plain of-table", "aria-label": `Table of ${title}` }, "Table");
  const update = () => {
    set(button, { "aria-expanded": String(open.has(title)) });
    element.classList.toggle("tabled", open.has(title));
    held.box?.remove();
    held.box = null;
    if (!open.has(title)) return;
    Object.assign(held, table(scene, title, columns, chart));
    listen(held, pick);
    element.append(held.box);
    mark(held, held.index);
  };
  button.addEventListener("click", () => {
    if (!open.delete(title)) open.add(title);
    update();
  });
  element.querySelector("figcaption").append(button);
  if (open.has(title)) update();
  return {
    element,
    show(index) {
      show(index);
      mark(held, index);
    },
  };
}

function table(scene, title, columns, { scale, most }) {
  const { label, unit, values } = scene.abscissa;
  const head = (words, of) => html("th", { scope: "col", class: "figure" }, of ? `${words} [${of}]` : words);
  const widest = values.reduce((sum, one) => Math.max(sum, Math.abs(one)), 0);
  const rows = values.map((value, index) =>
    html(
      "tr",
      { "data-index": index },
      html("th", { scope: "row", class: "figure" }, fixed(value, widest)),
      ...columns.map((one) => html("td", { class: "figure" }, one.values[index] === null ? "—" : `${one.values[index] >= one.most ? "> " : ""}${fixed(one.values[index] * scale.factor, most)}`)),
    ),
  );
  const whole = html(
    "table",
    {},
    html("caption", { class: "unseen" }, `${title} over ${label}`),
    html("thead", {}, html("tr", {}, head(label, unit), ...columns.map((one) => head(one.label, scale.unit)))),
    html("tbody", {}, ...rows),
  );
  const box = html("div", { class: "numbers", tabindex: 0, role: "region", "aria-label": `${title}: values. Arrow keys go from position to position.` }, whole);
  return { box, rows };
}

function listen(held, pick) {
  const at = (event, firm) => {
    const row = event.target.closest("tr[data-index]");
    if (row) pick(Number(row.dataset.index), firm);
  };
  held.box.addEventListener("pointerover", (event) => at(event, false));
  held.box.addEventListener("click", (event) => at(event, true));
  held.box.addEventListener("keydown", (event) => {
    const stride = STRIDES[event.key];
    if (stride === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    pick(Math.min(Math.max(held.index + stride, 0), held.rows.length - 1), true);
  });
}

/** Mark the row of a position and bring it into view, unless the pointer is among the rows. */
function mark(held, index) {
  const [before, now] = [held.rows[held.index], held.rows[index]];
  held.index = index;
  if (!held.box || !now) return;
  if (before) set(before, { "aria-current": null });
  set(now, { "aria-current": "true" });
  const { box } = held;
  if (!box.matches(":hover")) box.scrollTop = now.offsetTop - (box.clientHeight - now.offsetHeight) / 2;
}
