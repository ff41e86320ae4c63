// Arrows as paths, in pixels: straight for forces, bent for moments.

/** A vector: shaft and filled head, from (x, y) by (dx, dy). */
export function arrow(x, y, dx, dy) {
  const length = Math.hypot(dx, dy);
  if (!(length > 0.5)) return "";
  const [ux, uy] = [dx / length, dy / length];
  const size = Math.min(10, length);
  return `M${pair(x, y)}L${pair(x + dx - size * ux, y + dy - size * uy)}${head(x + dx, y + dy, ux, uy, size)}`;
}

/** A moment around the origin: {shaft, head}, counter-clockwise on the screen if `sense` is positive, else clockwise. */
export function bentArrow(radius, sense) {
  const side = sense > 0 ? 1 : -1; // the clockwise one is the mirror image
  const on = (angle) => [side * radius * Math.cos(angle), -radius * Math.sin(angle)];
  const [from, to] = [-Math.PI / 3, Math.PI];
  const back = 9 / radius; // the head takes the end of the arc
  const [ux, uy] = [-side * Math.sin(to - back / 2), -Math.cos(to - back / 2)];
  return {
    shaft: `M${pair(...on(from))}A${radius},${radius} 0 1 ${sense > 0 ? 0 : 1} ${pair(...on(to - back))}`,
    head: head(...on(to), ux, uy, 10),
  };
}

function head(x, y, ux, uy, size) {
  const wing = 0.36 * size;
  const [bx, by] = [x - size * ux, y - size * uy];
  return `M${pair(x, y)}L${pair(bx - wing * uy, by + wing * ux)}L${pair(bx + wing * uy, by - wing * ux)}Z`;
}

function pair(x, y) {
  return `${x.toFixed(1)},${y.toFixed(1)}`;
}

/** The greatest k with which every ray [x, y, dx, dy] ends at (x + k dx, y + k dy) inside the room. */
export function longest(rays, { left, right, top, bottom }) {
  const reach = (from, step, low, high) => (step === 0 ? Infinity : ((step > 0 ? high : low) - from) / step);
  return rays.reduce(
    (least, [x, y, dx, dy]) => Math.max(Math.min(least, reach(x, dx, left, right), reach(y, dy, top, bottom)), 0),
    Infinity,
  );
}
