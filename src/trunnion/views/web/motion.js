// What a motion in time has beside a cycle: speeds and energies over time, its events, figures of the present time.

import { at, full, nearest, peak } from "./data.js";
import { quantity } from "./format.js";

/** The speeds of the free drivers; angles and lengths in charts of their own. */
export function speedCharts(scene) {
  return ["rad", "m"].flatMap((unit) => {
    const drivers = scene.motion.free.filter((one) => one.unit === unit);
    const series = drivers.map(({ name, rate }, order) => ({ label: name, values: full(rate, scene.count), kind: `k${order % 6}` }));
    return series.length ? [{ title: "Speed", unit: `${unit}/s`, series }] : [];
  });
}

/** Works since the start and energies; none where there is neither. */
export function energyChart(scene) {
  const series = scene.motion.energies.map(({ label, values }, order) => ({
    label,
    values: full(values, scene.count),
    kind: `k${order % 6}`,
  }));
  return series.length ? [{ title: "Works and energies", unit: "J", series }] : [];
}

/** Forces and gaps of the contacts of joints in play; none where there is none. */
export function contactCharts(scene) {
  const { contacts } = scene.motion;
  const series = (key) => contacts.map((one, order) => ({ label: one.name, values: full(one[key], scene.count), kind: `k${order % 6}` }));
  if (!contacts.length) return [];
  const note = "Below 0 the surfaces press each other in.";
  return [{ title: "Contact forces", unit: "N", series: series("force") }, { title: "Gaps", unit: "m", note, series: series("gap") }];
}

/** Coordinate and speed of every free driver at the present time, as [label, index => text]. */
export function stateRows({ motion }) {
  return (motion?.free ?? []).flatMap(({ name, unit, coordinate, rate }) => [
    [`${unit === "rad" ? "angle" : "slide"} ${name}`, (index) => quantity(at(coordinate, index), unit, peak(coordinate))],
    [`speed ${name}`, (index) => quantity(at(rate, index), `${unit}/s`, peak(rate))],
  ]);
}

/** Let the times in the table of events move the motion there. */
export function listenToEvents(table, scene, crank) {
  if (!scene.motion) return;
  const { values } = scene.abscissa;
  const scale = scene.motion.duration > 0 ? values[values.length - 1] / scene.motion.duration : 1;
  table?.addEventListener("click", (event) => {
    const time = event.target.dataset?.time;
    if (time !== undefined) crank.go(nearest(scene.abscissa, Number(time) * scale));
  });
}
