// Numbers as an engineer reads them: an SI prefix that fits, sensible digits, true minus signs.
// The same rules as trunnion/results/quantities.py; tests/views holds both to one table of cases.

const PREFIXES = { "-4": "p", "-3": "n", "-2": "µ", "-1": "m", 0: "", 1: "k", 2: "M", 3: "G" };
const [SMALLEST, LARGEST] = [0.01, 1e4]; // of a figure in the unit of its page; others have their own
const SCALABLE = new Set(["N m", "N", "W", "m", "s", "J", "Pa"]);

/**
 * Factor and unit for `peak`: those of its page, `units` {SI unit: [factor, unit]}, where it fits, else those that bring
 * it between 1 and 1000: {factor: 0.001, unit: "kN m"} for 18 750 N m.
 */
export function prefixed(peak, unit, units = {}) {
  const [common, name] = units[unit] ?? [0, ""];
  if (name && !name.endsWith(unit)) return { factor: common, unit: name }; // of feet and pounds
  if (Math.abs(peak) * common >= SMALLEST && Math.abs(peak) * common < LARGEST) return { factor: common, unit: name };
  if (unit === "rad") return { factor: 180 / Math.PI, unit: "°" };
  if (!SCALABLE.has(unit) || !Number.isFinite(peak) || peak === 0) {
    return { factor: 1, unit: unit === "1" ? "" : unit };
  }
  const rounded = Number(Math.abs(peak).toPrecision(4)); // 999.99 N reads as 1.000 kN
  const step = Math.min(Math.max(Math.floor(Math.log10(rounded) / 3 + 1e-12), -4), 3);
  return { factor: 10 ** (-3 * step), unit: PREFIXES[step] + unit };
}

/** A number with so many significant digits; "—" where there is none. */
export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "—";
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(Number(value.toPrecision(digits)))));
  if (size < -4 || size >= 7) {
    const [mantissa, power] = value.toExponential(Math.min(digits, 3) - 1).split("e");
    return `${mantissa}×10${superscript(Number(power))}`.replace("-", "−");
  }
  return grouped(value.toFixed(Math.max(digits - 1 - size, 0)));
}

/** A number with its unit, the prefix chosen for it or for `peak`, so that a running figure keeps its unit. */
export function quantity(value, unit, peak = value, units = {}) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "—";
  const scale = prefixed(peak, unit, units);
  // A figure that runs keeps its decimals: those that give its peak four digits.
  const text = peak === value ? number(value * scale.factor) : fixed(value * scale.factor, peak * scale.factor);
  return text + (scale.unit === "" || scale.unit === "°" ? "" : "\u00a0") + scale.unit;
}

/** A number with as many decimals as give `peak` four digits. */
export function fixed(value, peak, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "—";
  const size = peak ? Math.floor(Math.log10(Math.abs(peak))) : 0;
  const text = value.toFixed(Math.min(Math.max(digits - 1 - size, 0), 12));
  return grouped(Number(text) === 0 ? text.replace("-", "") : text);
}

/** Round numbers from low to high, about `count` of them; over degrees, round angles. */
export function ticks(low, high, count = 5, degrees = false) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const steps = degrees && span >= 60 ? [15, 30, 45, 60, 90, 180, 360, 720] : round(span / count);
  const step = steps.find((one) => span / one <= count + 1e-9) ?? steps[steps.length - 1];
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, index) => Number(((first + index) * step).toPrecision(12)));
}

function round(rough) {
  const base = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 2.5, 5, 10, 20].map((one) => one * base);
}

/** The round number next below `value`: 1, 2 or 5 times a power of ten. */
export function roundBelow(value) {
  const base = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].map((one) => one * base).find((one) => one <= value * (1 + 1e-9));
}

/** A tick's label, with no more decimals than the step between ticks asks for. */
export function tickLabel(value, step) {
  let decimals = 0;
  while (decimals < 12 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6) decimals += 1;
  return grouped((Math.abs(value) < 1e-9 * Math.abs(step) ? 0 : value).toFixed(decimals));
}

/** A stated quantity, without zeros that promise precision: "1 kN". */
export function stated(value, unit) {
  const scale = prefixed(value, unit);
  const text = grouped(String(Number((value * scale.factor).toPrecision(4))));
  return scale.unit ? `${text}\u00a0${scale.unit}` : text;
}

function grouped(text) {
  const [whole, decimals] = text.replace("-", "−").split(".");
  const spaced = whole.replace(/\B(?=(\d{3})+(?!\d))/g, "\u202f");
  return decimals === undefined ? spaced : `${spaced}.${decimals}`;
}

function superscript(power) {
  return [...String(power)].map((sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻").join("");
}

/** A name that fits into the drawing; the whole of it is in the tooltip. */
export function short(name) {
  const signs = [...name];
  return signs.length > 14 ? `${signs.slice(0, 13).join("")}…` : name;
}
