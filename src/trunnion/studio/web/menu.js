// The menu of what lies under the pointer, a long touch or the focus: what can be done with it.

import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { edit, undo } from "./actions.js";
import { dictionary, groundOf } from "./geometry.js";
import { allLinks, chooseLinks, chosenLinks, groupActions } from "./group.js";
import { chosenOf } from "./masses.js";
import { partsAt, sheet } from "./sheet.js";
import * as state from "./state.js";
import { choose, click, removePart } from "./tools.js";
import { html } from "./ui.js";

/** {x, y, title, rows}: where it is open, px of the window, and [[label, does]]; or null. */
const menu = signal(null);

const NOUNS = { links: "Link", joints: "Joint", points: "Point", loads: "Load", springs: "Spring", gears: "Gear pair" };

/** Open it for a part, or for the sheet, at a place in m. */
export function openMenu(under, at) {
  if (state.spatial.peek() || !state.answer.peek()) return;
  const part = chosenOf(under) ?? chosenOf(partsAt(at).find(({ kind }) => kind !== "others") ?? null);
  const [x, y] = sheet.view.frame.to(at);
  const names = chosenLinks();
  const group = names.length > 0 && (!part || (part.kind === "links" && names.includes(part.name)));
  if (part && !group) state.selection.value = part;
  const rows = group ? groupActions(names).map(([label, , does]) => [label, does]) : part ? rowsOf(part, at) : ofSheet(at);
  menu.value = { x, y, title: group ? `${names.length} chosen` : part ? `${NOUNS[part.kind]} ${part.name}` : "Sheet", rows };
}

/** Open it for what is in focus, else what is chosen, else the sheet where the cross is. */
export function openByKey(target, cross) {
  const focused = target.dataset?.kind ? { kind: target.dataset.kind, name: target.dataset.name } : null;
  const part = focused ?? (cross ? null : state.selection.value);
  const { width, height } = sheet.view.frame;
  const spot = part && sheet.spots().find(({ kind, name }) => kind === part.kind && name === part.name);
  const middle = sheet.view.frame.from([width / 2, height / 2]);
  openMenu(part, spot?.at ?? cross ?? placeOf(part) ?? middle);
}

/** Where a chosen link is. */
function placeOf(part) {
  const node = part && sheet.view.root.querySelector(`g[data-kind="${part.kind}"][data-name="${CSS.escape(part.name)}"]`);
  if (!node) return null;
  const [box, own] = [node.getBoundingClientRect(), sheet.view.root.getBoundingClientRect()];
  return sheet.view.frame.from([box.left + box.width / 2 - own.left, box.top + box.height / 2 - own.top]);
}

function with_(tool, spot) {
  choose(tool);
  click(spot);
}

function properties(part) {
  state.selection.value = part;
  state.tab.value = "properties";
}

function rowsOf(part, at) {
  const { kind, name } = part;
  const { entries, numbers = {} } = state.answer.peek();
  const last = [`Delete ${NOUNS[kind].toLowerCase()}`, () => removePart(part)];
  const first = ["Properties", () => properties(part)];
  if (kind === "links") return [first, ...ofLink(name, at, numbers), ...groupActions([name]).map(([label, , does]) => [label, does])];
  if (kind !== "joints" && kind !== "points") return [first, last];
  const spot = sheet.spots().find((one) => one.kind === kind && one.name === name);
  if (!spot) return [first, last];
  const own = kind === "joints";
  const grounded = own && entries?.joints?.[name]?.links?.includes(groundOf(entries));
  return [
    first,
    ...(own && !dictionary(entries?.drivers)[name] ? [["Drive it", () => edit([{ do: "driver", joint: name }])]] : []),
    ...(own ? [["Load against its motion", () => edit([{ do: "load", against: name }])]] : []),
    ...(own ? [] : [["Pin it to the ground", () => edit([{ do: "pin", point: name }])]]),
    ["Draw a link from here", () => with_("link", spot)],
    ["Join it with …", () => with_("join", spot)],
    ...(grounded ? [] : [["Let it slide …", () => with_("slide", spot)]]),
    ["Force on it …", () => with_("load", spot)],
    ["Spring from here …", () => with_("spring", spot)],
    last,
  ];
}

function ofLink(name, at, numbers) {
  const spot = sheet.snapOn(at, true, { kind: "links", name }, 0);
  return [
    ["Point here", () => edit([{ do: "add-point", link: name, at: spot.at }])],
    ["Pin it to the ground here", () => edit([{ do: "pin", point: { on: name, at: spot.at } }])],
    ["Draw a link from here", () => with_("link", spot)],
    ["Force here …", () => with_("load", spot)],
    ...(numbers[`links.${name}.mass`] > 0 ? [["Mass centre here", () => edit([{ do: "centre", link: name, at: spot.at }])], ["Mass centre to the middle", () => edit([{ do: "centre", link: name }])]] : []),
  ]; // prettier-ignore
}

function ofSheet(at) {
  const last = state.past.peek().at(-1);
  return [
    ["Draw a link from here", () => with_("link", sheet.snap(at))],
    ...(allLinks().length ? [["Choose links by a box", () => choose("box")], ["Choose all links", () => chooseLinks(allLinks())]] : []),
    ["Show all", () => sheet.fit()],
    ...(last ? [[`Undo: ${last.name}`, undo]] : []),
  ]; // prettier-ignore
}

export function ContextMenu() {
  const element = useRef(null);
  const open = menu.value;
  const close = () => (menu.value = null);
  useEffect(() => {
    if (!open) return undefined;
    const node = element.current;
    const before = document.activeElement;
    const room = node.parentElement.getBoundingClientRect();
    node.style.left = `${Math.max(Math.min(open.x, room.width - node.offsetWidth - 6), 6)}px`;
    node.style.top = `${Math.max(Math.min(open.y, room.height - node.offsetHeight - 6), 6)}px`;
    node.querySelector("button").focus();
    const away = ({ target }) => node.contains(target) || close();
    document.addEventListener("pointerdown", away);
    return () => {
      document.removeEventListener("pointerdown", away);
      if (node.contains(document.activeElement) || document.activeElement === document.body) (before?.isConnected && before !== document.body ? before : sheet.view?.root)?.focus();
    };
  }, [open]);
  if (!open) return null;
  const keys = (event) => {
    const rows = [...element.current.querySelectorAll("button")];
    const here = rows.indexOf(document.activeElement);
    const next = { ArrowDown: here + 1, ArrowUp: here - 1, Home: 0, End: -1 }[event.key];
    if (event.key === "Escape" || event.key === "Tab") close();
    else if (next !== undefined) rows.at(next % rows.length).focus();
    else if (event.key === "Enter" || event.key === " ") return event.stopPropagation();
    event.preventDefault();
    return event.stopPropagation();
  };
  const take = (does) => () => {
    close();
    does();
  };
  return html`<div class="context" role="menu" aria-label=${open.title} ref=${element} onKeyDown=${keys} onContextMenu=${(event) => event.preventDefault()}>
    <b>${open.title}</b>
    ${open.rows.map(([label, does]) => html`<button type="button" role="menuitem" class="plain" onClick=${take(does)}>${label}</button>`)}
  </div>`;
}
