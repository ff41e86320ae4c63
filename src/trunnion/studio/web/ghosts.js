// The other ways in which the mechanism can be put together, drawn faintly; one click takes one.

import { effect, signal } from "@preact/signals";
import { set, svg } from "../web/dom.js";
import { outline, standing } from "../web/plane.js";
import { assemblies, edit } from "./actions.js";
import * as state from "./state.js";

/** [{name, gestures, points}] of the present text while they are shown. */
export const others = signal([]);

/** Ask for them whenever they are wanted and there is a new answer. */
export function keepOthers() {
  effect(() => {
    const wanted = state.layers.value.others && state.solved.value && !state.spatial.value;
    others.value = [];
    if (wanted && state.answer.value.text === state.text.value) assemblies().then((found) => (others.value = found));
  });
}

export function takeOther(name) {
  const found = others.value.find((one) => one.name === name);
  if (found) edit(found.gestures);
}

/** Put the ghosts to a position of the cycle. */
export function poseGhosts({ layers, scene, frame, exact: index }, list) {
  const box = layers.ghosts;
  if (box.childElementCount !== list.length)
    box.replaceChildren(...list.map(() => svg("g", { class: "ghost", "data-kind": "others" }, svg("title"), svg("path"))));
  list.forEach(({ name, points }, order) => {
    const node = box.children[order];
    set(node, { "data-name": name });
    node.firstChild.textContent = `other assembly: ${name}; click to take it`;
    const links = scene.links.filter((link) => !link.ground);
    const { spots } = standing({ points }, frame, index, {});
    set(node.lastChild, { d: links.map((link) => outline(spots(link.points))).join("") });
  });
}
