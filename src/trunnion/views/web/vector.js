// Vectors [x, y, z], matrices as three rows, quaternions {w, i, j, k}: the little that a drawing in space needs.

export function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** a + factor b. */
export function plus(a, b, factor = 1) {
  return [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
}

export function scaled(a, factor) {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

export function unit(a) {
  return scaled(a, 1 / (Math.hypot(...a) || 1));
}

/** Matrix times vector. */
export function apply(matrix, a) {
  return [dot(matrix[0], a), dot(matrix[1], a), dot(matrix[2], a)];
}

/** Matrix times matrix. */
export function product(a, b) {
  const columns = [0, 1, 2].map((column) => b.map((row) => row[column]));
  return a.map((row) => columns.map((column) => dot(row, column)));
}

/** The rotation of a unit quaternion. */
export function rotation({ w, i, j, k }) {
  return [
    [1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j)],
    [2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i)],
    [2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j)],
  ];
}
