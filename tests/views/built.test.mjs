// Magnified errors: poses and points between the ideal mechanism and the one as built. Run by test_built_scene.py.
import assert from "node:assert/strict";
import test from "node:test";

import { jumpsAt, leaning, magnified, movedBy, play, stretched, told } from "../../src/trunnion/views/web/built.js";
import { apply, cross, plus, rotation, scaled } from "../../src/trunnion/views/web/vector.js";

const near = (one, two, most = 1e-12) => one.forEach((value, order) => assert.ok(Math.abs(value - two[order]) < most, `${one} ≠ ${two}`));
const PLANE = {
  count: 2,
  points: { "a.P": { x: [1, 2], y: [0] }, "ground.O": { x: [0], y: [0] } },
  links: [{ name: "ground", ground: true, angle: [0] }, { name: "a", angle: [0.5, null] }],
  built: {
    points: { "a.P": { x: [0.01, -0.02], y: [0.001] }, "ground.O": { x: [0], y: [0] } },
    links: { ground: [0], a: [0.1, null] },
    seats: [{ joint: "J", clearance: 2e-5 }],
  },
};

test("in the plane points and angles are at the ideal place and so many times the error", () => {
  const [ideal, same, large] = [0, 1, 10].map((factor) => magnified(PLANE, factor));
  near(ideal.points["a.P"].x, [0.99, 2.02]);
  near(large.points["a.P"].x, [1.09, 1.82]);
  near(large.points["a.P"].y, [0.009, 0.009]);
  assert.deepEqual(same.points, PLANE.points);
  assert.deepEqual(large.points["ground.O"], PLANE.points["ground.O"]); // what stands still stays one number
  near([large.links[1].angle[0]], [0.5 + 9 * 0.1]);
  assert.equal(large.links[1].angle[1], null);
  assert.equal(play(large, "J"), 2e-4);
  assert.equal(play(large, "K"), 0);
  near([leaning(large, { links: ["ground", "a"] }, 0)], [1]);
});

test("without errors the scene is as it was", () => {
  const plain = { ...PLANE, built: null };
  assert.deepEqual(magnified(plain, 100), { ...plain, factor: 100 });
  assert.equal(play(magnified(plain, 100), "J"), 0);
});

test("a pose turns about the middle of its points", () => {
  const half = 0.4;
  const old = { x: 1, y: 2, z: 3, w: Math.cos(half), i: 0, j: 0, k: Math.sin(half) };
  const about = [0.5, 0.1, -0.2];
  const place = (pose, point) => plus(apply(rotation(pose), point), [pose.x, pose.y, pose.z]);
  const [shift, round] = [[0.01, -0.02, 0.03], [1e-4, 2e-4, -3e-4]];
  const now = movedBy(old, about, shift, round);
  near(place(now, about), plus(place(old, about), shift));
  const point = [1, 1, 1];
  const arm = plus(place(old, point), place(old, about), -1);
  near(place(now, point), plus(plus(place(old, point), shift), cross(round, arm)), 1e-6);
  near(Object.values(movedBy(now, about, scaled(shift, -1), scaled(round, -1))), [1, 2, 3, old.w, 0, 0, old.k], 1e-12);
  near(Object.values(movedBy(old, about, [0, 0, 0], [0, 0, 0])), [1, 2, 3, old.w, 0, 0, old.k]);
});

test("a stretch moves each joint by its own error, what lies between by a mean", () => {
  const error = { stretch: [{ at: [0, 0, 0], by: [1, 0, 0] }, { at: [2, 0, 0], by: [-1, 0, 0] }] };
  near(stretched(error, [0, 0, 0], 3), [3, 0, 0]);
  near(stretched(error, [1, 0, 0], 3), [1, 0, 0]);
  assert.ok(stretched(error, [0.5, 0, 0], 1)[0] > 0.5);
  near(stretched({ stretch: [] }, [1, 2, 3], 5), [1, 2, 3]);
});

test("numbers without zeros behind, and jumps", () => {
  assert.deepEqual([told(199.6), told(1), told(-12.34, 3)], ["200", "1", "−12.3"]);
  assert.ok(jumpsAt(null, [0, 0], 5) && jumpsAt([0, 0], [6, 0], 5) && !jumpsAt([0, 0], [4, 0], 5));
});
