// A spring in the drawing: a zigzag between its ends.

const TURNS = 8;
const WIDTH = 7; // px, to each side
const END = 0.18; // share of the length that is straight at each end

/** The path between two places; none if an end has no place. */
export function coil(ends) {
  if (ends.length < 2) return "";
  const [[x1, y1], [x2, y2]] = ends;
  const length = Math.hypot(x2 - x1, y2 - y1) || 1;
  const across = [(-(y2 - y1) * WIDTH) / length, ((x2 - x1) * WIDTH) / length];
  const corners = [[END, 0]];
  for (let turn = 0; turn < 2 * TURNS; turn += 1)
    corners.push([END + ((1 - 2 * END) * (turn + 0.5)) / (2 * TURNS), turn % 2 ? -1 : 1]);
  corners.push([1 - END, 0], [1, 0]);
  const spot = ([along, side]) =>
    `${(x1 + along * (x2 - x1) + side * across[0]).toFixed(1)},${(y1 + along * (y2 - y1) + side * across[1]).toFixed(1)}`;
  return `M${x1.toFixed(1)},${y1.toFixed(1)}L${corners.map(spot).join("L")}`;
}
