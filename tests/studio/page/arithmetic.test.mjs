// Arithmetic of the studio's page, run by node in a folder where the modules lie as they are served: studio/ and web/.
import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";

const served = pathToFileURL(`${process.argv[2]}/`);
const load = (name) => import(new URL(name, served));
const geometry = await load("studio/geometry.js");
const fields = await load("studio/fields.js");
const { decode } = await load("studio/socket.js");

// ---- grid and lengths
assert.equal(geometry.roundAbove(0.013), 0.02);
assert.equal(geometry.roundAbove(0.02), 0.02);
assert.equal(geometry.roundAbove(21), 50);
assert.equal(geometry.onGrid(0.12499999, 0.01), 0.12);
assert.equal(geometry.onGrid(0.30000000000000004, 0.1), 0.3);
assert.equal(geometry.lengthOf("60", "mm"), 0.06);
assert.equal(geometry.lengthOf("2,5 in", "mm"), 0.0635);
assert.equal(geometry.lengthOf("1.2m", "mm"), 1.2);
for (const wrong of ["", "0", "-3 mm", "3 kg", "a", "1 2", "1,000"]) assert.equal(geometry.lengthOf(wrong, "mm"), null, wrong);
assert.equal(geometry.lengthText(0.0512, "mm", 0.001), "51 mm");

// ---- what a pointer takes
const spots = [{ kind: "joints", name: "A", key: "crank.A", at: [0, 0] }, { kind: "points", name: "bar.E", key: "bar.E", at: [0.01, 0] }];
assert.equal(geometry.snap(spots, [0.004, 0], { near: 0.02, step: 0.01 }).name, "A");
assert.equal(geometry.snap(spots, [0.006, 0], { near: 0.02, step: 0.01 }).name, "bar.E");
assert.deepEqual(geometry.snap(spots, [0.112, 0.058], { near: 0.02, step: 0.01 }).at, [0.11, 0.06]);

assert.deepEqual(geometry.onLine([[0, 0], [1, 0]], [0.3, 0.01], 0.02), [0.3, 0]);
assert.deepEqual(geometry.onLine([[0, 0], [1, 0]], [0.3, 0.03], 0.02), [0.3, 0.03]);
assert.deepEqual(geometry.crossing([[0, 0], [2, 1]], [[0, 1], [2, 0]], [1.01, 0.5], 0.02), [1, 0.5]);
assert.deepEqual(geometry.crossing([[0, 0], [2, 0]], [[0, 1], [2, 1]], [1, 0.5], 0.02), [1, 0.5]);

// ---- a mechanism that is only drawn
const entries = {
  links: { ground: { points: { A: [0, 0] } }, bar: { points: { A: [0, 0], B: [1, 0] } } },
  joints: { A: { type: "revolute", links: ["ground", "bar"] }, half: { type: "revolute" } },
  loads: "nonsense",
};
const places = { "ground.A": [0, 0], "bar.A": [0, 0], "bar.B": [0.6, 0.8], "gone.C": [1, 1] };
const drawn = geometry.sketch(entries, places);
assert.deepEqual(drawn.joints.map((one) => one.name), ["A"]);
assert.deepEqual(drawn.links.map((one) => one.ground), [true, false]);
assert.deepEqual(geometry.spotsOf(drawn, 0).map((one) => one.name), ["A", "bar.B"]);
assert.deepEqual(geometry.placesAt(drawn, 0)["bar.B"], [0.6, 0.8]);
for (const odd of [null, {}, { links: 3, joints: [] }, { links: { a: null } }]) geometry.sketch(odd, {});
const rack = { joints: { S: { type: "prismatic", links: ["ground", "bar"] }, A: entries.joints.A }, gears: { mesh: { joints: ["S", "A"] } } };
const circle = geometry.sketch({ ...entries, ...rack }, { ...places, "bar.S": [1, 0] }, { "gears.mesh.radius": -0.02 }).gears;
assert.deepEqual(circle, [{ name: "mesh", at: "bar.A", radius: 0.02 }]);
assert.deepEqual(fields.rowsOf({ gears: { mesh: { joints: ["S", "A"], lead: "5 mm" } } }, "gears", "mesh").map(({ label }) => label).sort(), ["joints", "lead", "phase"]);

// ---- the position that can be drawn
const track = { count: 5, points: { "a.P": { x: [null, null, 1, 2, null], y: [0] } } };
assert.deepEqual([0, 1, 2, 3, 4].map((index) => geometry.posedAt(track, index)), [2, 2, 2, 3, 3]);
assert.ok(geometry.assembled(track));
assert.ok(!geometry.assembled({ count: 2, points: { "a.P": { x: [null], y: [0] } } }));

// ---- values as the file writes them
assert.equal(fields.written(" 0.3 "), 0.3);
assert.equal(fields.written("2 kg"), "2 kg");
assert.equal(fields.written("  "), null);
assert.equal(fields.written("60", "mm"), "60 mm"); // never 60 m for who leaves off the unit
assert.equal(fields.written("0", "mm"), 0);
assert.equal(fields.written("5,5", "mm"), "5.5 mm");
assert.equal(fields.written(",5 mm"), "0.5 mm");
assert.equal(fields.written("max(1,2)"), "max(1,2)");
assert.ok(fields.ambiguous("1,000 mm") && !fields.ambiguous("1,25 mm"));
assert.equal(fields.usualUnit({ dimensions: { a: "3 m", b: "2 m" }, links: { c: { points: { P: ["5 mm", 0] } } } }), "m");
assert.equal(fields.written("60 m", "mm"), "60 m");
assert.equal(fields.unitOf({ value: "60 mm ± 0.05 mm", example: null }), "mm");
assert.equal(fields.unitOf({ value: "0.004", example: "5 mm" }), ""); // a plain number was SI and stays it
assert.equal(fields.unitOf({ value: null, example: "5 mm" }), "mm");
assert.equal(fields.unitOf({ value: ["0", "-100 N"], example: null }, 0), "N");
assert.equal(fields.unitOf({ value: "2 * AB", example: null }), "");
assert.deepEqual(fields.numberOf("60 mm ± 0.05"), { value: 60, rest: "mm ± 0.05" });
assert.deepEqual(fields.numberOf("2.5e-3"), { value: 0.0025, rest: "" });
assert.equal(fields.numberOf("r / 3"), null);
assert.equal(fields.numberOf("2 * AB"), null);
const rows = fields.rowsOf({ links: { ground: {}, bar: { points: { A: [0, "L"] }, mass: "2 kg" } } }, "links", "bar");
assert.deepEqual(fields.rowsOf({ links: { ground: { mass: "2 kg" } } }, "links", "ground").map(({ label }) => label), ["mass"]);
assert.deepEqual(rows.map(({ label, value }) => [label, value]), [["point A", ["0", "L"]], ["mass", "2 kg"], ["moment of inertia", null], ["mass centre", null]]);
const plain = fields.rowsOf({ links: { ground: {}, bar: { mass: 2, centre: [0, 0.03] } } }, "links", "bar").map(({ label }) => label);
assert.deepEqual(plain, ["mass, kg", "moment of inertia", "mass centre, m"]); // a number without a unit is in SI
const found = [{ where: "links.bar.mass" }, { where: "links.barrel" }, { where: null }];
assert.equal(fields.findingsOf(found, ["links", "bar"]).length, 1);
assert.deepEqual(fields.partOf({ where: "links.bar.mass" }, { links: { bar: {} } }), { kind: "links", name: "bar" });
assert.equal(fields.partOf({ where: "drivers" }, {}), null);

// ---- the force in a slide, with its friction along the guide
const { forceAt } = await load("web/data.js");
const sliding = { links: ["lever", "block"], axis: [0, 1], reaction: { x: [3], y: [1, null] }, friction: [2] };
const lever = { links: [{ name: "lever", angle: [Math.PI / 2] }] };
assert.deepEqual(forceAt(lever, sliding, 0).map((part) => Number(part.toFixed(12))), [1, 1]);
assert.equal(forceAt(lever, sliding, 1), null);

// ---- the locking margin in words
assert.equal(fields.told([4, null, 0.5, 10], { value: 0.5, beyond: false, at: "90°" }, 0), "4 here, least 0.5 at 90°");
assert.equal(fields.told([4, null, 0.5, 10], { value: 0.5, beyond: false, at: "90°" }, 1), "none here, least 0.5 at 90°");
assert.equal(fields.told([4, null, 0.5, 10], { value: 0.5, beyond: false, at: "90°" }, 2), "0.5 here: it locks, least 0.5 at 90°");
assert.equal(fields.told([4, null, 0.5, 10], { value: 0.5, beyond: false, at: "90°" }, 3), "> 10 here, least 0.5 at 90°");
assert.equal(fields.told([10], { value: 10, beyond: true, at: "0°" }, 7), "> 10 everywhere");
assert.equal(fields.told(null, null, 0), "—");
assert.equal(fields.at({ value: 3, beyond: true }), "> 3 here");
assert.equal(fields.at({ value: 0.8, beyond: false }), "0.8 here: it locks");
assert.equal(fields.at({ value: null, beyond: false }), "none here");

// ---- answers
const header = JSON.stringify({ ask: "model", points: { A: { x: { column: [1, 2] } } }, list: [1, null] });
const text = new TextEncoder().encode(header.padEnd(Math.ceil(header.length / 4) * 4));
const bytes = new Uint8Array(4 + text.length + 12);
new DataView(bytes.buffer).setUint32(0, text.length, true);
bytes.set(text, 4);
bytes.set(new Uint8Array(new Float32Array([9, 0.5, NaN]).buffer), 4 + text.length);
const answer = decode(bytes.buffer);
assert.deepEqual(answer.points.A.x, [0.5, null]);
assert.deepEqual(answer.list, [1, null]);
assert.equal(answer.body.length, 12);
