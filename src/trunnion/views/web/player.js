// The crank: play, scrub, step. One place holds the present position; all views are told of a change.

import { html, set } from "./dom.js";

const CYCLES = [2, 4, 8, 16, 32]; // seconds in which the run is played
const SPEEDS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10]; // of real time
const LASTS = 8; // seconds that a motion is played in at least about, and a fifth and five times of it in real time
const PLAY = "M4,2.5v11l9.5,-5.5Z";
const PAUSE = "M4,3h3v10H4zM9,3h3v10H9z";

/** The speeds a motion of so many seconds can be played at, and the one to begin with: real time if that can be seen. */
export function speeds(duration) {
  const seen = (factor) => duration / factor >= LASTS / 16 && duration / factor <= 16 * LASTS;
  const list = SPEEDS.filter((factor) => factor === 1 || seen(factor));
  if (duration >= LASTS / 5 && duration <= 5 * LASTS) return { list, usual: 1 };
  const off = (factor) => Math.abs(Math.log(duration / factor / LASTS));
  return { list, usual: list.reduce((best, one) => (off(one) < off(best) ? one : best)) };
}

/** How fast it goes: in how many seconds, or of a motion in time at which speed. {element, run(): seconds} */
function pacer(duration) {
  const name = duration === null ? "Time in which the run is played" : "Speed at which the motion is played";
  const { list, usual } = duration === null ? { list: CYCLES, usual: 8 } : speeds(duration);
  const text = (one) => (duration === null ? `${one} s` : one === 1 ? "real time" : `× ${one}`);
  const pace = html("select", { "aria-label": name }, ...list.map((one) => html("option", { value: one }, text(one))));
  pace.value = String(usual);
  const element = html("label", { class: "pace" }, html("span", {}, duration === null ? "run in" : "speed"), pace);
  return { element, run: () => (duration === null ? Number(pace.value) : duration / Number(pace.value)) };
}

/**
 * Controls for `count` positions; `describe(index)` is the position in words, `onShow(index, share)` is called on a
 * change. While it plays, `onBetween(share)` tells how far it is from the position to the next, 0 where it stands.
 * duration: of a motion in time, s; it is played at a speed and stops at its end, while a cycle begins again.
 * Returns {element, go, pause, playing, index}.
 */
export function player(count, describe, onShow, { svg, duration = null, onBetween = (_) => {} }) {
  const once = duration !== null;
  const icon = svg("path", { d: PLAY });
  const button = html(
    "button",
    { type: "button", class: "play", "aria-label": "Play" },
    svg("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, icon),
  );
  const back = html("button", { type: "button", class: "step", "aria-label": once ? "One step back" : "One position back" }, "‹");
  const on = html("button", { type: "button", class: "step", "aria-label": once ? "One step on" : "One position on" }, "›");
  const slider = html("input", {
    type: "range",
    min: 0,
    max: count - 1,
    step: 1,
    value: 0,
    "aria-label": once ? "Time" : "Position of the drive",
  });
  const pace = pacer(duration);
  const element = html(
    "div",
    { class: "player", role: "group", "aria-label": "Motion" },
    button,
    back,
    slider,
    on,
    pace.element,
  );
  const state = { index: 0, exact: 0, timer: 0, last: 0 };

  const show = (index, share = 0) => {
    state.index = once ? Math.min(Math.max(index, 0), count - 1) : ((index % count) + count) % count;
    slider.value = String(state.index);
    set(slider, { "aria-valuetext": describe(state.index) });
    onShow(state.index, share);
  };
  const pause = () => {
    cancelAnimationFrame(state.timer);
    state.timer = 0;
    icon.setAttribute("d", PLAY);
    button.setAttribute("aria-label", "Play");
    onBetween(0);
  };
  const frame = (now) => {
    state.exact += ((now - state.last) / 1000 / pace.run()) * (once ? count - 1 : count);
    state.last = now;
    if (once && state.exact >= count - 1) return go(count - 1);
    state.exact %= count;
    const index = Math.floor(state.exact);
    if (index !== state.index) show(index, state.exact - index);
    else onBetween(state.exact - index);
    state.timer = requestAnimationFrame(frame);
  };
  const play = () => {
    if (once && state.index === count - 1) show(0);
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
