// What the page says of an answer, in words.

/** The margin here and the least: "4.27 here, least 3.45 at 0 mm". */
export function told(margin, least, index) {
  if (!least) return "—";
  const here = margin[Math.min(index, margin.length - 1)];
  if (least.beyond) return "> 10 everywhere";
  const whole = `least ${number(least.value)} at ${least.at}`;
  return `${at({ value: here, beyond: here >= 10 })}, ${whole}`;
}

/** The margin of one position: "4.27 here", "> 3 here". */
export function at({ value, beyond }) {
  if (value === null) return "none here";
  return `${beyond ? "> " : ""}${number(value)} here${value <= 1 ? ": it locks" : ""}`;
}

function number(value) {
  return Number(value.toPrecision(3)).toString();
}
