// A mechanism in space, drawn as the report draws it: it is looked at and changed as text or by its values.

import { effect, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { spaceView } from "../web/space.js";
import { cornered, kindsOf } from "./sheet.js";
import * as state from "./state.js";
import { theme } from "./theme.js";
import { html } from "./ui.js";

export function Space() {
  const holder = useRef(null);
  const view = useRef(null);
  const of = useRef(null);
  useEffect(() =>
    effect(() => {
      theme.value;
      const { scene: present } = state.answer.value ?? {};
      const scene = cornered.value?.scene ?? present;
      if (!scene || scene.space !== "spatial") return;
      untracked(() => {
        const camera = of.current === present ? view.current?.camera?.() : undefined; // a corner is looked at from the same side
        of.current = present;
        view.current = spaceView(scene, kindsOf(scene), camera);
        if (cornered.value) view.current.reactions([], 1); // only its places are told
        holder.current.replaceChildren(...[view.current.element, view.current.controls].filter(Boolean));
      });
    }), []); // prettier-ignore
  useEffect(() =>
    effect(() => {
      state.answer.value;
      cornered.value;
      const factor = state.factor.value;
      untracked(() => view.current?.magnify(factor));
    }), []); // prettier-ignore
  useEffect(() =>
    effect(() => {
      state.answer.value;
      cornered.value;
      const index = state.index.value;
      view.current?.show(index);
    }), []); // prettier-ignore
  return html`<div class="in-space" ref=${holder}></div>`;
}
