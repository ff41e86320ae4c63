// Preact's elements written as text, and the few controls that panels share.

import { h } from "preact";
import { useEffect, useRef } from "preact/hooks";
import htm from "htm";

export const html = htm.bind(h);

/** Bring what is typed or chosen next into focus, if it is there. */
export function focusOn(/** @type {string} */ selector) {
  const found = document.querySelector(selector);
  if (found instanceof HTMLElement) found.focus();
}

/** A button that tells its key in the tooltip. */
export function Button({ label, title, onClick, disabled = false, pressed, kind = "", children }) {
  return html`<button type="button" class=${`plain ${kind}`} title=${title ?? label} aria-label=${label} aria-pressed=${pressed} disabled=${disabled} onClick=${onClick}>
    ${children ?? label}
  </button>`;
}

/** Go to the choice of a menu that an arrow key, Home or End means; the menu opens. Whether the key was one of these. */
function stepTo(menu, key) {
  const by = { ArrowDown: 1, ArrowUp: -1, Home: 0, End: -1 }[key];
  if (by === undefined) return false;
  menu.open = true;
  const choices = [...menu.querySelectorAll(".choices button:not(:disabled), .choices input")];
  const here = key === "Home" || key === "End" ? -1 : choices.indexOf(document.activeElement);
  const next = here < 0 ? (by < 0 ? choices.length - 1 : 0) : (here + by + choices.length) % choices.length;
  choices[next]?.focus();
  return true;
}

/** A menu that opens below its label; a choice or a click elsewhere closes it. */
export function Menu({ label, disabled = false, children }) {
  const element = useRef(null);
  useEffect(() => {
    const away = ({ target }) => {
      if (element.current?.open && !element.current.contains(target)) element.current.open = false;
    };
    for (const kind of ["pointerdown", "focusin"]) document.addEventListener(kind, away);
    return () => ["pointerdown", "focusin"].forEach((kind) => document.removeEventListener(kind, away));
  }, []);
  const close = (event) => {
    if (event.target.closest("button")) event.currentTarget.open = false;
  };
  const keys = (event) => {
    const menu = event.currentTarget;
    if (event.key === "Escape" && menu.open) {
      menu.open = false;
      menu.firstElementChild.focus();
    } else if (!stepTo(menu, event.key)) return;
    event.preventDefault();
    event.stopPropagation();
  };
  if (disabled) return html`<span class="menu"><button type="button" class="plain" disabled>${label}</button></span>`;
  return html`<details class="menu" ref=${element} onClick=${close} onKeyDown=${keys}>
    <summary class="plain">${label}</summary>
    <div class="choices">${children}</div>
  </details>`;
}

/** Pictures of 20 × 20, lines only. */
const ICONS = {
  select: "M5 3l11 7-5 1.2 3 5-2 1.2-3-5.1L5 16z",
  box: "M3 5h2M7 5h2M11 5h2M15 5h2v2M17 9v2M17 13v2h-2M13 15h-2M9 15H7M5 15H3v-2M3 11V9M3 7V5",
  link: "M5 15L15 5M5 15m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0-5 0M15 5m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0-5 0",
  pin: "M10 6m-2.5 0a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0-5 0M10 8.5L6 15h8zM3 15h14M5 15l-2 3M9 15l-2 3M13 15l-2 3M17 15l-2 3",
  join: "M4 16L9.2 10.8M10.8 9.2L16 4M10 10m-2.4 0a2.4 2.4 0 1 0 4.8 0a2.4 2.4 0 1 0-4.8 0M4 4l4 4M16 16l-4-4",
  slide: "M6 6h8v6h-8zM2 14.5h16M5 14.5l-2 3M9 14.5l-2 3M13 14.5l-2 3M17 14.5l-2 3",
  driver: "M10 10m-2 0a2 2 0 1 0 4 0a2 2 0 1 0-4 0M16.5 10a6.5 6.5 0 1 0-3 5.5M13.5 15.5l3.2-.2M13.5 15.5l.6-3.2",
  point: "M3 16C3 7 9 3 16 4M11.5 5.2m-2 0a2 2 0 1 0 4 0a2 2 0 1 0-4 0",
  load: "M10 2v12M10 17l-3.5-5h7zM5 18h10",
  spring: "M2 10h3l1.5-4 3 8 3-8 2.5 8 1-4h2",
  gear: "M7 7m-2 0a2 2 0 1 0 4 0a2 2 0 1 0-4 0M12 7a5 5 0 1 1-10 0a5 5 0 1 1 10 0M18.5 14a3.6 3.6 0 1 1-7.2 0a3.6 3.6 0 1 1 7.2 0M14.9 14h.1",
  delete: "M5 5l10 10M15 5L5 15",
  undo: "M8 4L4 8l4 4M4 8h8a4 4 0 0 1 0 8H8",
  redo: "M12 4l4 4-4 4M16 8H8a4 4 0 0 0 0 8h4",
  fit: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4",
  light: "M10 10m-3.5 0a3.5 3.5 0 1 0 7 0a3.5 3.5 0 1 0-7 0M10 2v2M10 16v2M2 10h2M16 10h2M4.3 4.3l1.4 1.4M14.3 14.3l1.4 1.4M4.3 15.7l1.4-1.4M14.3 5.7l1.4-1.4",
  dark: "M16 12A7 7 0 0 1 8 4a6.5 6.5 0 1 0 8 8z",
  system: "M10 3a7 7 0 1 0 0 14a7 7 0 1 0 0-14zM10 3v14M12.4 3.6v12.8M14.8 5.2v9.6",
};

export function Icon({ name }) {
  return html`<svg class="icon" viewBox="0 0 20 20" aria-hidden="true"><path d=${ICONS[name]} /></svg>`;
}
