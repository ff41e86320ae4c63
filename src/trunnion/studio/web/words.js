// What the page says of an answer, in words.

/** The margin here and the least: "4.27 here, least 3.45 at 0 mm". */
export function told(margin, least, index) {
  if (!least) return "—";
  const here = margin[Math.min(index, margin.length - 1)];
  if (least.beyond) return "> 10 everywhere";
  const whole = `least ${number(least.value)} at ${least.at}`;
  if (here === null) return `none here, ${whole}`;
  return `${here >= 10 ? "> 10" : number(here)} here${here <= 1 ? ": it locks" : ""}, ${whole}`;
}

function number(value) {
  return Number(value.toPrecision(3)).toString();
}
