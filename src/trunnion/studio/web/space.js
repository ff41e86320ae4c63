// A mechanism in space, drawn as the report draws it: it is looked at and changed as text or by its values.

import { effect, untracked } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { spaceView } from "../web/space.js";
import { kindsOf } from "./sheet.js";
import * as state from "./state.js";
import { theme } from "./theme.js";
import { html } from "./ui.js";

export function Space() {
  const holder = useRef(null);
  const view = useRef(null);
  useEffect(() =>
    effect(() => {
      theme.value;
      const { scene } = state.answer.value ?? {};
      if (!scene || scene.space !== "spatial") return;
      untracked(() => {
        view.current = spaceView(scene, kindsOf(scene));
        holder.current.replaceChildren(...[view.current.element, view.current.controls].filter(Boolean));
      });
    }), []); // prettier-ignore
  useEffect(() =>
    effect(() => {
      state.answer.value;
      const index = state.index.value;
      view.current?.show(index);
    }), []); // prettier-ignore
  return html`<div class="in-space" ref=${holder}></div>`;
}
