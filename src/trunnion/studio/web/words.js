// What the page says of an answer, in words.

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
