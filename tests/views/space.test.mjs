// The browser's functions for drawings in space; run by test_space.py, or by hand: node --test tests/views
import assert from "node:assert/strict";
import test from "node:test";

import { extent, keyed, looking, projection, shifted, turned, zoomed } from "../../src/trunnion/views/web/camera.js";
import { meshes, seen, shades, stroke } from "../../src/trunnion/views/web/solids.js";
import { apply, cross, dot, plus, product, rotation } from "../../src/trunnion/views/web/vector.js";

const near = (one, two, most = 1e-12) => [one].flat(3).forEach((value, order) => assert.ok(Math.abs(value - [two].flat(3)[order]) < most, `${one} ≠ ${two}`));
const IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const STILL = { turn: IDENTITY, place: [0, 0, 0] };

test("a quaternion turns as its axis and angle say", () => {
  const half = 0.7;
  const turn = rotation({ w: Math.cos(half), i: 0, j: 0, k: Math.sin(half) });
  near(apply(turn, [1, 0, 0]), [Math.cos(1.4), Math.sin(1.4), 0]);
  near(product(turn, rotation({ w: Math.cos(half), i: 0, j: 0, k: -Math.sin(half) })), IDENTITY);
});

test("a camera is a right-handed frame with z upright", () => {
  for (const [around, above] of [[0.3, 0.4], [-2, 1.2], [3, -0.5]]) {
    const [right, up, towards] = looking(around, above);
    near(cross(right, up), towards);
    near(dot(up, up), 1);
    assert.ok(right[2] === 0 && up[2] > 0);
  }
  near(looking(-Math.PI / 2, 0), [[1, 0, 0], [0, 0, 1], [0, -1, 0]]);
});

test("views are turned, shifted, zoomed about the pointer, and not over the pole", () => {
  const view = { around: 0, above: 0.5, zoom: 1, shift: [10, 0] };
  assert.equal(turned(view, 0, 1e4).above, Math.PI / 2);
  assert.ok(turned(view, 10, 0).around < 0); // what is in front follows the pointer
  near(shifted(view, 3, 4).shift, [13, 4]);
  near(zoomed(view, 2, [10, 0]).shift, [10, 0]);
  near(zoomed(view, 2, [0, 0]).shift, [20, 0]);
  assert.equal(zoomed(view, 1e9).zoom, 40);
  assert.equal(keyed(view, "a", false, view), null);
  assert.equal(keyed({ ...view, zoom: 3 }, "0", false, view), view);
  near(keyed(view, "ArrowUp", true, view).shift, [10, 30]);
});

const SOLIDS = {
  rod: { kind: "rod", points: [[0, 0, 0], [0, 0, 0.3], [0.4, 0.1, 0.3]], radius: 0.02 },
  ball: { kind: "ball", points: [[0.1, 0.2, 0.3]], radius: 0.05 },
  box: { kind: "box", points: [[0, 0, 1], [0.1, 0, 0], [0, 0, 0.2], [0, 0.3, 0]] },
};

test("facets look outwards, and the outline is larger", () => {
  for (const [name, solid] of Object.entries(SOLIDS)) {
    const [outline, body] = meshes(solid, 1).map(({ points, faces }) => {
      const fans = faces.flatMap((face) => face.slice(2).map((corner, order) => [face[0], face[order + 1], corner]));
      return fans.reduce((sum, [a, b, c]) => sum + dot(points[a], cross(points[b], points[c])) / 6, 0);
    });
    assert.ok(outline > body && body > 0, `${name}: ${outline}, ${body}`);
  }
  const { points, faces } = meshes(SOLIDS.box, 1)[1];
  const fans = faces.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]);
  near(fans.reduce((sum, [a, b, c]) => sum + dot(points[a], cross(points[b], points[c])) / 6, 0), 8 * 0.1 * 0.2 * 0.3);
});

test("of a body its near side is seen, of its outline the far side", () => {
  const camera = { matrix: looking(0.4, 0.6), to: ([right, up]) => [right, -up] };
  for (const solid of Object.values(SOLIDS)) {
    const [outline, body] = meshes(solid, 1);
    const [far, close] = [outline, body].map((mesh) => seen(mesh, "k", STILL, camera));
    assert.ok(close.length > 0 && far.length > 0);
    assert.ok(close.length < body.faces.length && far.length < outline.faces.length);
    const mean = (pieces) => pieces.reduce((sum, { depth }) => sum + depth, 0) / pieces.length;
    assert.ok(mean(far) < mean(close));
    assert.ok(close.every(({ shade }) => shade >= 0 && shade < 24) && far.every(({ shade }) => shade === "ink"));
  }
});

test("a line breaks where there is no place", () => {
  const camera = { matrix: IDENTITY, to: ([right, up]) => [right, up] };
  assert.equal(stroke([[0, 0, 0], [1, 0, 0], null, [2, 0, 0], [3, 0, 2]], "#000", 1, camera).length, 2);
  near(stroke([[2, 0, 0], [3, 0, 2]], "#000", 1, camera)[0].depth, 1);
});

test("shades go from dark to light", () => {
  const list = shades("#0072b2");
  assert.equal(list.length, 24);
  const sum = (text) => text.match(/\d+/g).map(Number).reduce((a, b) => a + b);
  assert.ok(list.slice(1).every((shade, order) => sum(shade) >= sum(list[order])));
  near(plus([1, 2, 3], [1, 1, 1], -1), [0, 1, 2]);
});

test("a turned view has the whole mechanism in the picture, and the first view is as it was", () => {
  const reach = [[0, 0, 0], [0.4, 0.02, 0], [0.4, 0, 0.05], [0.1, 0.9, 0.1]]; // prettier-ignore
  const home = { around: 0.3, above: 0.4 };
  const seen = extent(reach, looking(home.around, home.above));
  const scene = { view: home };
  const [width, height, margin, below] = [600, 400, 40, 30];
  const scale = Math.min((width - 2 * margin) / seen.size[0], (height - below - 2 * margin) / seen.size[1]);
  const frame = { width, height, margin, scale, middle: seen.middle };
  for (const [around, above] of [[0.3, 0.4], [1.9, 0.4], [0.3, 1.5], [-2.0, -0.7]]) {
    const camera = { around, above, zoom: 1, shift: [0, 0] };
    const { matrix, to } = projection({ scene, camera, frame, reach }, below);
    const pixels = reach.map((place) => to(apply(matrix, place)));
    assert.ok(pixels.every(([x, y]) => x > margin - 1 && x < width - margin + 1 && y > margin - 1 && y < height - below - margin + 1));
    const wide = Math.max(...pixels.map(([x]) => x)) - Math.min(...pixels.map(([x]) => x));
    const tall = Math.max(...pixels.map(([, y]) => y)) - Math.min(...pixels.map(([, y]) => y));
    assert.ok(wide > width - 2 * margin - 1 || tall > height - below - 2 * margin - 1);
  }
});
