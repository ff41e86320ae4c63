// The crank: play, scrub, step. One place holds the present position; all views are told of a change.

import { html, set } from "./dom.js";

const CYCLES = [2, 4, 8, 16, 32]; // seconds in which the run is played
const PLAY = "M4,2.5v11l9.5,-5.5Z";
const PAUSE = "M4,3h3v10H4zM9,3h3v10H9z";

/**
 * Controls for `count` positions; `describe(index)` is the position in words, `onShow(index)` is called on a change.
 * Returns {element, go, pause, playing, index}.
 */
export function player(count, describe, onShow, { svg }) {
  const icon = svg("path", { d: PLAY });
  const button = html(
    "button",
    { type: "button", class: "play", "aria-label": "Play" },
    svg("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, icon),
  );
  const back = html("button", { type: "button", class: "step", "aria-label": "One position back" }, "‹");
  const on = html("button", { type: "button", class: "step", "aria-label": "One position on" }, "›");
  const slider = html("input", {
    type: "range",
    min: 0,
    max: count - 1,
    step: 1,
    value: 0,
    "aria-label": "Position of the drive",
  });
  const pace = html(
    "select",
    { "aria-label": "Time in which the run is played" },
    ...CYCLES.map((time) => html("option", { value: time }, `${time} s`)),
  );
  pace.value = "8";
  const element = html(
    "div",
    { class: "player", role: "group", "aria-label": "Motion" },
    button,
    back,
    slider,
    on,
    html("label", { class: "pace" }, html("span", {}, "run in"), pace),
  );
  const state = { index: 0, exact: 0, timer: 0, last: 0 };

  const show = (index) => {
    state.index = ((index % count) + count) % count;
    slider.value = String(state.index);
    set(slider, { "aria-valuetext": describe(state.index) });
    onShow(state.index);
  };
  const pause = () => {
    cancelAnimationFrame(state.timer);
    state.timer = 0;
    icon.setAttribute("d", PLAY);
    button.setAttribute("aria-label", "Play");
  };
  const frame = (now) => {
    state.exact = (state.exact + ((now - state.last) / 1000 / Number(pace.value)) * count) % count;
    state.last = now;
    if (Math.floor(state.exact) !== state.index) show(Math.floor(state.exact));
    state.timer = requestAnimationFrame(frame);
  };
  const play = () => {
    [state.exact, state.last] = [state.index, performance.now()];
    state.timer = requestAnimationFrame(frame);
    icon.setAttribute("d", PAUSE);
    button.setAttribute("aria-label", "Pause");
  };
  const go = (index) => {
    pause();
    show(index);
  };
  const toggle = () => (state.timer ? pause() : play());

  button.addEventListener("click", toggle);
  back.addEventListener("click", () => go(state.index - 1));
  on.addEventListener("click", () => go(state.index + 1));
  slider.addEventListener("input", () => go(Number(slider.value)));
  set(button, { disabled: count < 2 });
  return { element, go, pause, toggle, playing: () => state.timer !== 0, index: () => state.index, last: count - 1 };
}

/** What a key asks for: a position, "toggle", or null if it is none of ours. Shift steps by ten. */
export function command(key, shift, index, last) {
  const stride = shift ? 10 : 1;
  if (key === "ArrowRight") return index + stride;
  if (key === "ArrowLeft") return index - stride;
  if (key === "Home") return 0;
  if (key === "End") return last;
  return key === " " ? "toggle" : null;
}

/** Let the keyboard move the crank, except where a key means something else to the element in focus. */
export function listenToKeys(target, crank) {
  target.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || event.defaultPrevented) return;
    const own = event.target.type === "range";
    if (event.target.closest?.("select, textarea, input:not([type=range]), a, summary, [contenteditable]")) return;
    if (event.key === " " && event.target.closest?.("button")) return;
    const wish = command(event.key, event.shiftKey, crank.index(), crank.last);
    if (wish === null || (own && event.key === "Tab")) return;
    event.preventDefault();
    if (wish === "toggle") crank.toggle();
    else crank.go(wish);
  });
}
