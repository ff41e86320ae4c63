// The file as written, as fields: a row for each value that is there, and for the usual ones that are not.

import { dictionary, groundOf } from "./geometry.js";

/** Values a part may well have: path within it, and an example. */
const USUAL = {
  links: [["mass", "2 kg"], ["inertia", "0.01 kg m^2"], ["centre", ["50 mm", "0"]]],
  joints: [["friction.coefficient", "0.1"], ["pin.radius", "5 mm"], ["pin.bearing", "30 mm"], ["pin.clearance", "0.02 mm"]],
  slides: [["friction.coefficient", "0.1"], ["guide.length", "40 mm"], ["guide.clearance", "0.02 mm"]],
  drivers: [["speed", "60 rpm"], ["range", ["0 deg", "90 deg"]], ["start", "0 deg"]],
  loads: [["force", ["0 N", "-100 N"]], ["moment", "1 N m"], ["useful", null]],
  resistances: [["resisting_force", "100 N"], ["resisting_torque", "10 N m"], ["only", null], ["useful", null]],
  springs: [["stiffness", "1 N/mm"], ["free_length", "50 mm"], ["preload", "0 N"]],
  gears: [["ratio", "-1/2"], ["phase", "0 deg"]],
  model: [["name", "Slider-crank"], ["gravity", ["0", "-9.81"]], ["joint_defaults.friction", "0.1"], ["joint_defaults.pin.radius", "5 mm"], ["joint_defaults.pin.bearing", "30 mm"], ["joint_defaults.guide.length", "40 mm"]],
}; // prettier-ignore

const IN_SPACE = { gravity: ["0", "0", "-9.81"], centre: ["50 mm", "0", "0"], force: ["0 N", "0 N", "-100 N"] };
const FIXED = new Set(["type", "links", "link", "at", "between", "joint", "joints"]); // drawn, not typed
/** Sections that are no rows of the model: parts, dimensions, and what is long and edited as text. */
const OWN_PLACE = ["loop", "links", "joints", "drivers", "loads", "springs", "gears", "dimensions", "assembly", "notes", "references", "trunnion", "space", "ground",
  "measures", "tolerances", "tolerance_defaults", "correlations", "costs", "processes"]; // prettier-ignore

/** Values that are chosen, with the words for them, "" for none; nothing of a value that is typed. */
function choicesOf(kind, key, part, entries) {
  if (kind === "springs" && key === "only") return { "": "either way", pull: "pull", push: "push" };
  if (kind === "loads" && key === "useful") return { "": "—", true: "yes", false: "no" };
  if (kind !== "loads" || key !== "only") return null;
  const { type, links } = dictionary(entries?.joints)[part.joint] ?? {};
  if (type !== "prismatic") return { "": "either way", positive: "counterclockwise", negative: "clockwise" };
  const axis = links?.[0] === groundOf(entries) ? (entries.links?.[links[0]]?.points?.[part.joint]?.axis ?? [1, 0]) : [];
  const angle = Math.round((Math.atan2(axis[1], axis[0]) * 180) / Math.PI);
  const to = (by) => (Number.isFinite(angle) ? `, towards ${(angle + by + 360) % 360}°` : "");
  return { "": "either way", positive: `forward${to(0)}`, negative: `backward${to(180)}` };
}

/**
 * Rows of a part, [{path, label, value, example, fixed, choices}]; value is a text, a list of texts, or null where the file says
 * nothing. kind: a section of the file, or "model" for what is in no section.
 */
export function rowsOf(entries, kind, name) {
  const row = kind === "joints" ? rowOfLoop(entries, name) : -1;
  const part = kind === "model" ? ownOf(entries) : row < 0 ? dictionary(entries?.[kind])[name] : { ...entries.loop[row], joint: undefined };
  const from = kind === "model" ? [] : row < 0 ? [kind, name] : ["loop", row];
  const there = [...(kind === "links" ? lengths(entries, name) : []), ...leaves(part, from)].map((row) => ({ ...row, example: null }));
  const known = (path) => there.some((row) => starts(row.path, path) || starts(path, row.path));
  const spatial = entries?.space === "spatial";
  const usual = usualOf(kind, part, kind === "links" && name === groundOf(entries))
    .filter(([way]) => !way.endsWith("pin.bearing") || (spatial && part?.type !== "spherical")) // it carries a moment across, in space
    .map(([way, example]) => [way, (spatial && IN_SPACE[way]) || example]);
  const missing = usual
    .map(([way, example]) => ({ path: [...from, ...way.split(".")], value: null, example, fixed: false, common: kind === "joints" ? commonTo(entries, way.split(".")) : null }))
    .filter(({ path }) => !known(path));
  const ways = usual.map(([way]) => [...from, ...way.split(".")]);
  const order = ({ path }) => {
    const at = ways.findIndex((way) => starts(way, path) || starts(path, way));
    return at < 0 && kind === "model" ? ways.length : at; // of a part what has no place in the list stands first: its type, its links
  };
  const rows = [...there, ...missing].sort((a, b) => order(a) - order(b)); // a row stays where it is when it is filled
  return rows.filter(({ path }) => path[2] !== "joint").map((row) => ({ ...row, where: from[0] === "loop" ? ["loop", name, ...row.path.slice(2)] : row.path, label: row.label ?? labelOf(row.path.slice(from.length), row.value), choices: choicesOf(kind, row.path[2], part, entries) }));
}

/** Which row of the table of a loop has a joint; -1 where none has. */
export function rowOfLoop(entries, joint) {
  return Array.isArray(entries?.loop) ? entries.loop.findIndex((row) => row?.joint === joint) : -1;
}

function usualOf(kind, part, fixed) {
  if (fixed) return [];
  if (kind === "loads" && part?.joint) {
    const other = "resisting_force" in part ? "resisting_torque" : "resisting_force";
    return USUAL.resistances.filter(([way]) => way !== other);
  }
  const slides = kind === "gears" && ["radius", "lead"].find((key) => key in dictionary(part));
  if (slides) return [[slides, "20 mm"], ["phase", "0 mm"]];
  return USUAL[part?.type === "prismatic" ? "slides" : kind] ?? [];
}

/** The lengths of a link from its point at [0, 0] to those on its x axis: their first coordinates under another name. */
function lengths(entries, name) {
  if (name === groundOf(entries)) return [];
  const points = Object.entries(dictionary(entries?.links?.[name]?.points)).map(([point, stated]) => {
    const nested = !Array.isArray(stated);
    return { point, at: nested ? dictionary(stated).at : stated, way: nested ? ["at", 0] : [0] };
  });
  const zero = (value) => Number(value) === 0;
  const origin = points.find(({ at }) => Array.isArray(at) && at.every(zero));
  const ends = origin ? points.filter(({ at }) => Array.isArray(at) && !zero(at[0]) && at.slice(1).every(zero)) : [];
  return ends.map(({ point, at, way }) => ({ path: ["links", name, "points", point, ...way], label: `length ${origin.point}–${point}`, value: String(at[0]), fixed: false }));
}

/** What all joints have that state nothing of their own; null where that is nothing. */
function commonTo(entries, [key, inner]) {
  const there = dictionary(entries?.joint_defaults)[key];
  const value = typeof there === "object" ? dictionary(there)[inner] : inner === "coefficient" ? there : null;
  return ["string", "number"].includes(typeof value) ? String(value) : null;
}

function ownOf(entries) {
  return Object.fromEntries(Object.entries(dictionary(entries)).filter(([key]) => !OWN_PLACE.includes(key)));
}

function leaves(part, path) {
  const fixed = path.length === 3 && FIXED.has(path[2]);
  if (Array.isArray(part)) {
    const plain = part.every((one) => one === null || typeof one !== "object");
    return plain ? [{ path, value: part.map(String), fixed }] : [{ path, value: "see the text", fixed: true }];
  }
  if (part === null || part === undefined) return path.length > 2 ? [{ path, value: "", fixed }] : [];
  if (typeof part !== "object") return [{ path, value: String(part), fixed }];
  return Object.entries(part).flatMap(([key, one]) => leaves(one, [...path, key]));
}

function starts(path, other) {
  return other.length <= path.length && other.every((key, order) => path[order] === key);
}

/** Keys of the file whose words alone do not say what they are. */
const WORDS = {
  inertia: "moment of inertia", inertia_about: "inertia about", centre: "mass centre", only: "acts", useful: "counts as useful", link: "on link", joint: "at joint", between: "from … to",
  speed: "speed of the drive", range: "range of the drive", start: "start of the drive", moves: "moves joint", free_length: "length without force",
}; // prettier-ignore
/** SI units of numbers that the file has without one. */
const SI = {
  mass: "kg", inertia: "kg m²", centre: "m", force: "N", moment: "N m", resisting_force: "N", resisting_torque: "N m", stiffness: "N/m", free_length: "m", preload: "N", gravity: "m/s²",
  radius: "m", length: "m", clearance: "m", bearing: "m", offset: "m", lead: "m", damping: "N s/m",
}; // prettier-ignore

function labelOf(path, value) {
  const names = path.filter((key) => key !== "joint_defaults").map((key) => (key === "points" ? "point" : key));
  const words = names.map((key) => WORDS[key] ?? String(key).replaceAll("_", " ")).join(" ");
  const unit = value !== null && [value].flat().some((one) => bare(one)) ? SI[names[names.length - 1]] : null;
  const whole = path[0] === "friction" && path.length === 1 ? "friction coefficient" : words;
  return `${whole}${path[0] === "joint_defaults" ? " of all joints" : ""}${unit ? `, ${unit}` : ""}`;
}

/** What a part of a list is: x and y of a place or a vector, from and to of a range. */
export function partOfList(path, order) {
  const last = path[path.length - 1];
  if (last === "range" || last === "between") return ["from", "to"][order];
  return ["force", "centre", "gravity", "at", "axis"].includes(last) || path[2] === "points" ? "xyz"[order] : `part ${order + 1}`;
}

/** Typed letters with decimal points for decimal commas; "1,000", which may be a thousand, stays as it is. */
export function plainNumber(typed) {
  const own = String(typed).trim();
  return /[([]/.test(own) || ambiguous(own) ? own : own.replace(/(\d),(?=\d)/g, "$1.").replace(/(^|[^\d.]),(?=\d)/g, "$10.");
}

/** Whether a comma in typed letters may part thousands. */
export const ambiguous = (typed) => !/[([]/.test(typed) && /\d,\d{3}(?!\d)/.test(typed);

/** What is written for typed letters: a number stays a number, or takes the unit; nothing takes the entry away. */
export function written(typed, unit = "") {
  const plain = plainNumber(typed);
  if (plain === "") return null;
  const number = Number(plain);
  return Number.isFinite(number) ? (unit && number !== 0 ? `${plain} ${unit}` : number) : plain;
}

/** The unit that a bare number typed for a row takes: that of the value that was there, of its list, or of the example. */
export function unitOf({ value, example }, order = 0) {
  const there = [value ?? example].flat();
  return [there[order], ...there].map((one) => numberOf(one ?? "")?.rest.split("±")[0].trim()).find(Boolean) ?? "";
}

/** Whether letters are a number without a unit, not 0. */
export const bare = (typed) => Number.isFinite(Number(plainNumber(typed))) && Number(plainNumber(typed)) !== 0;

/** The unit of lengths that the file has most often; "mm" where it has none. */
export function usualUnit(entries) {
  const found = JSON.stringify([entries?.dimensions, entries?.links]).match(/[\d.]\s*(mm|cm|µm|um|m|in|ft)(?=")/g) ?? [];
  const units = found.map((one) => one.replace(/^[\d.]\s*/, ""));
  const count = (unit) => units.filter((one) => one === unit).length;
  return units.sort((a, b) => count(b) - count(a))[0] ?? "mm";
}

/** A number with what follows it, {value, rest}, or null where it is an expression. */
export function numberOf(typed) {
  const found = /^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*((?:[a-zµ°"'^0-9/ ]*)(?:±.*)?)$/i.exec(String(typed));
  return found && { value: Number(found[1]), rest: found[2].trim() };
}

/** The findings of a part or of one of its values. */
export function findingsOf(findings, path) {
  const at = path.join(".");
  return (findings ?? []).filter(({ where }) => where === at || where?.startsWith(`${at}.`));
}

/** Whether a part is of the model, stated by the file or drawn for its loop; a text that cannot be read tells nothing. */
export function isPart({ entries, scene }, { kind, name }) {
  if (!entries) return true;
  const rows = Array.isArray(entries.loop) ? entries.loop : [];
  if (rows.some((row) => row?.[kind.slice(0, -1)] === name)) return true;
  if (kind !== "points") return dictionary(entries[kind])[name] !== undefined || Boolean(scene?.[kind]?.some((one) => one.name === name));
  const [link, ...point] = name.split(".");
  return dictionary(dictionary(entries.links)[link]?.points)[point.join(".")] !== undefined || Boolean(scene?.points[name]);
}

/** The part that a finding is about, {kind, name}, or null. */
export function partOf({ where, part }, entries) {
  const [kind, name] = String(part ?? where ?? "").split(".");
  return kind in USUAL && kind !== "slides" && dictionary(entries?.[kind])[name] !== undefined ? { kind, name } : null;
}

// ---- the locking margin in words -----------------------------------------------------------------------------------

/** The margin here and the least: "4.27 here, least 3.45 at 0 mm". */
export function told(margin, lowest, index) {
  if (!lowest) return "—";
  const here = margin[Math.min(index, margin.length - 1)];
  if (lowest.beyond) return "> 10 everywhere";
  return `${at({ value: here, beyond: here >= 10 })}, least ${least(lowest)}`;
}

/** The margin of one position: "4.27 here", "> 3 here". */
export function at({ value, beyond }) {
  if (value === null) return "none here";
  return `${beyond ? "> " : ""}${number(value)} here${!beyond && value <= 1 ? ": it locks" : ""}`;
}

/** The least margin of the cycle: "0.77 at 0 mm", "> 10". */
export function least(found) {
  if (!found) return "none";
  return found.beyond ? "> 10" : `${number(found.value)} at ${found.at}`;
}

function number(value) {
  return Number(value.toPrecision(3)).toString();
}
