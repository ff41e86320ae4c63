// The guide of a slide between two moving links: a bar of the first link with a slit in it for the block.

import { guide, place } from "./data.js";
import { set, svg } from "./dom.js";

const BEYOND = 26; // px that the slit is longer than the travel of the block's middle, at each end

/** The slots of a scene, [{joint, reach, parts, node}]; reach: from the first link's point along the guide, metres. */
export function slotsOf(scene, tintOf) {
  const ground = scene.links.find((link) => link.ground)?.name;
  return scene.joints
    .filter((joint) => joint.type === "prismatic" && !joint.links.includes(ground))
    .map((joint) => {
      const kind = tintOf(joint.links[0]);
      const bar = ["edge", "underlay", "plate"].map((name) => svg("path", { class: `${name} ${kind}` }));
      const slit = svg("path", { class: "slit" });
      return { joint, reach: travel(scene, joint), bar, slit, node: svg("g", { class: "slot" }, ...bar, slit) };
    });
}

/** Least and greatest slide over all positions. */
function travel(scene, joint) {
  let [low, high] = [Infinity, -Infinity];
  for (let index = 0; index < scene.count; index += 1) {
    const [on, at] = [place(scene, joint.on, index), place(scene, joint.at, index)];
    if (!on || !at) continue;
    const angle = guide(scene, joint, index);
    const slide = (at[0] - on[0]) * Math.cos(angle) + (at[1] - on[1]) * Math.sin(angle);
    [low, high] = [Math.min(low, slide), Math.max(high, slide)];
  }
  return [low, high];
}

/** Put a slot to a position; `frame` maps metres to pixels. */
export function poseSlot({ joint, reach, bar, slit }, scene, frame, index) {
  const spot = place(scene, joint.on, index);
  const angle = guide(scene, joint, index);
  const path = (low, high) => {
    if (!spot || !(low <= high)) return "";
    const [x, y] = frame.to(spot);
    const end = (along) => `${(x + along * Math.cos(angle)).toFixed(1)},${(y - along * Math.sin(angle)).toFixed(1)}`;
    return `M${end(low)}L${end(high)}`;
  };
  const [low, high] = [reach[0] * frame.scale - BEYOND, reach[1] * frame.scale + BEYOND];
  bar.forEach((part) => set(part, { d: path(Math.min(low, 0), Math.max(high, 0)) })); // as far as the link's own point
  set(slit, { d: path(low, high) });
}
