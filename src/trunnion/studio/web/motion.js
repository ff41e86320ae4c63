// The player under the sheet, and the figures of the present position.

import { batch, effect, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { gaps, say } from "../web/data.js";
import { html as element, svg } from "../web/dom.js";
import { player } from "../web/player.js";
import { readout } from "../web/report.js";
import { changing, tells } from "./sheet.js";
import * as state from "./state.js";
import { html } from "./ui.js";

/** The crank of the present scene. */
export const crank = {
  player: null,
  go: (index) => crank.player?.go(index),
  toggle: () => crank.player?.toggle(),
  /** Where it was before a reader pointed at a curve, and where that led. */
  before: null,
  pointed: 0,
  /** Move to where a reader points; a played motion only if it is meant. */
  pick(index, firm) {
    if (!firm && crank.player?.playing()) return;
    if (firm || crank.before === null || state.index.peek() !== crank.pointed) crank.before = firm ? null : state.index.peek();
    crank.go(index);
    crank.pointed = state.index.peek();
  },
  /** The reader points there no longer: back to where it was, unless it was moved otherwise since. */
  leave() {
    if (crank.before !== null && !crank.player?.playing() && state.index.peek() === crank.pointed) crank.go(crank.before);
    crank.before = null;
  },
};

export function Motion() {
  const holder = useRef(null);
  useEffect(() => effect(() => fill(holder.current)), []);
  useEffect(() =>
    effect(() => {
      const index = state.index.value;
      if (crank.player && crank.player.index() !== index) crank.player.go(index);
    }), []); // prettier-ignore
  useEffect(() => effect(() => follow(state.live.value)), []);
  return html`<div class="motion" ref=${holder}></div>`;
}

function fill(holder) {
  const whole = state.solved.value ? state.answer.value.scene : null;
  const scene = whole?.drivers.length ? whole : null;
  const first = state.findings.value.find(({ severity }) => severity === "error");
  untracked(() => {
    if (!scene) {
      crank.player?.pause();
      crank.player = null;
      const words = first ? `It does not move yet: ${first.what}${first.place ? ` (${first.place})` : ""}.` : whole ? "It stands still: no joint is driven." : state.answer.value?.outline ? "Being solved …" : "The mechanism moves as soon as it is whole and has a driver.";
      holder.replaceChildren(element("p", { class: "calm" }, words));
      return;
    }
    const figures = readout(scene);
    const show = (index, share) => {
      batch(() => ([state.index.value, state.share.value] = [index, share]));
      figures.show(index);
    };
    const same = crank.player && crank.count === scene.count && !scene.motion && !crank.once;
    if (!same) {
      crank.player?.pause();
      crank.player = player(scene.count, (index) => crank.words(index), (index, share) => crank.show(index, share), {
        svg,
        duration: scene.motion?.duration ?? null,
        onBetween: (share) => (state.share.value = share),
      });
      lightUp(crank);
    }
    Object.assign(crank, { count: scene.count, once: Boolean(scene.motion), words: figures.words, show });
    crank.strip.replaceChildren(...strips(scene));
    crank.band.style.background = bandOf(state.answer.value.margin);
    holder.replaceChildren(crank.player.element, figures.element);
    crank.own = crank.figures = figures.element;
    figures.show(state.index.value);
    if (!same) crank.player.go(Math.min(state.index.value, scene.count - 1));
  });
}

/** While the mechanism is being changed the figures are those of what it is changed to. */
function follow(live) {
  const scene = untracked(() => (state.solved.value ? state.answer.value.scene : null));
  if (!scene || !crank.figures?.isConnected) return;
  const index = state.index.peek();
  const told = live?.scene ?? (live?.points && tells(live, index) ? changing(scene, live) : null);
  const dragged = told && readout(told);
  dragged?.show(index);
  const element = dragged?.element ?? crank.own;
  if (element === crank.figures) return;
  crank.figures.replaceWith(element);
  crank.figures = element;
}

/** A strip under the slider for the positions that cannot be reached. */
function lightUp(held) {
  const slider = held.player.element.querySelector("input[type=range]");
  held.strip = element("span", { class: "strip" });
  held.band = element("span", { class: "margin-band", title: "Locking margin: the redder, the nearer a position is to locking" });
  const track = element("span", { class: "track-of-slider" });
  slider.replaceWith(track);
  track.append(slider, held.band, held.strip);
}

const STOPS = 120; // colours along the band
const FAR = 4; // so many times the friction are far from locking

/** The locking margin along the slider, as colours: red at 1 and below, none where it is far. */
function bandOf(margin) {
  if (!margin) return "none";
  const last = Math.max(margin.length - 1, 1);
  const length = Math.min(STOPS, margin.length);
  const colours = Array.from({ length }, (_, order) => {
    const index = Math.round((order * last) / Math.max(length - 1, 1));
    const near = margin[index] === null || margin[index] === undefined ? 0 : Math.min(Math.max((FAR - margin[index]) / (FAR - 1), 0), 1);
    return `color-mix(in srgb, var(--bad) ${(100 * near).toFixed(0)}%, transparent) ${((100 * index) / last).toFixed(1)}%`;
  });
  return `linear-gradient(to right, ${colours.join(", ")})`;
}

function strips(scene) {
  const last = Math.max(scene.count - 1, 1);
  return gaps(scene).map(([from, to]) => {
    const strip = element("span", { class: "lit", title: `no answer from ${say(scene, from)} to ${say(scene, to)}` });
    strip.style.left = `${(100 * from) / last}%`;
    strip.style.width = `max(3px, ${(100 * (to - from)) / last}%)`;
    return strip;
  });
}
