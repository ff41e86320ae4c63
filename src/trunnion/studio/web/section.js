// Sections along a pin in its hole in space: how far it lies off the middle and how it leans, across magnified.

import { arrow } from "../web/arrow.js";
import { at, full, peak } from "../web/data.js";
import { quantity, short } from "../web/format.js";
import * as state from "./state.js";
import { html } from "./ui.js";

const [WIDE, TALL] = [330, 156]; // px of a section
const [HALF, PLAY, PIN, WALL] = [112, 17, 24, 9]; // px: half the length, the play to either side, half the pin, the wall
const ARROW = 30; // px, of the largest load

/** The sections of a joint with a pin that has two ends in a hole, in z–x and in z–y of the hole; nothing for others. */
export function Sections({ joint }) {
  const scene = state.solved.value ? state.answer.value.scene : null;
  const seat = scene?.space === "spatial" && scene.built?.seats.find((one) => one.joint === joint);
  if (!seat || seat.ends.length !== 2 || !seat.length) return null;
  const index = state.index.value;
  const most = peak(...seat.ends.flatMap(({ force }) => ["x", "y"].map((axis) => full(force[axis], scene.count))));
  const times = Number(((PLAY / seat.clearance) * (seat.length / (2 * HALF))).toPrecision(3));
  return html`<h3>Section through the pin</h3>
    ${["x", "y"].map((axis) => html`<${Section} key=${axis} seat=${seat} axis=${axis} index=${index} most=${most} />`)}
    <p class="calm">Pin of ${short(seat.links[0])} in ${short(seat.links[1])}, ${quantity(seat.length, "m")} long, play ${quantity(seat.clearance, "m")} to either side: drawn ${times} times larger across than along.
      Dashed: how far its axis may go. Arrows: load on the hole at each end, the longest ${quantity(most, "N")}.</p>`; // prettier-ignore
}

function Section({ seat, axis, index, most }) {
  const ends = seat.ends.map(({ offset, force }) => ({ off: at(offset[axis], index), load: at(force[axis], index) }));
  const [x, y] = [WIDE / 2 + 8, TALL / 2];
  const known = ends.every(({ off }) => off !== null);
  const places = ends.map(({ off }, end) => [x + (end ? HALF : -HALF), y - ((off ?? 0) / seat.clearance) * PLAY]);
  const [[ax, ay], [bx, by]] = places;
  const more = 14 * ((by - ay) / (2 * HALF)); // it stands out at both ends
  const body = (half) => `M${ax - 14},${ay - more + half}L${bx + 14},${by + more + half}`;
  const middle = known ? (ends[0].off + ends[1].off) / 2 : null;
  const tilt = known ? (ends[1].off - ends[0].off) / seat.length : null;
  const told = known ? `offset ${quantity(middle, "m", seat.clearance)}, tilt ${quantity(1e3 * tilt, "mrad", (2e3 * seat.clearance) / seat.length)}` : "no answer";
  const loads = places.map(([px, py], end) => {
    const load = ((ends[end].load ?? 0) / (most || 1)) * ARROW;
    return load ? arrow(px, py - Math.sign(load) * PIN, 0, -load) : "";
  });
  const wall = (sign) => html`<rect class="wall" x=${x - HALF} y=${y + (sign > 0 ? PIN + PLAY : -PIN - PLAY - WALL)} width=${2 * HALF} height=${WALL} />`;
  return html`<svg class="pin-section" viewBox=${`0 0 ${WIDE} ${TALL}`} role="img" aria-label=${`Section of ${seat.joint} in z and ${axis}: ${told}`}>
    ${[1, -1].map(wall)}
    ${[1, -1].map((sign) => html`<path class="reach" d=${`M${x - HALF},${y - sign * PLAY}h${2 * HALF}`} />`)}
    ${known && html`<path class="pin-body k0" d=${`${body(-PIN)}${body(PIN).replace(/M(\S+)L(\S+)/, "L$2L$1")}Z`} /><path class="axis-of-pin" d=${body(0)} />`}
    ${known && html`<path class="reaction k1" d=${loads.join("")} />`}
    <text x="2" y="13">${axis}</text><text x=${WIDE - 12} y=${TALL - 6}>z</text><text x="20" y="13">${told}</text>
  </svg>`; // prettier-ignore
}
