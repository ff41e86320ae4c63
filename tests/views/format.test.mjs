// The browser's pure functions; run by test_browser.py, or by hand: node --test tests/views
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";

import {
  at,
  bounds,
  domain,
  gaps,
  hull,
  magnitude,
  nearest,
  say,
  total,
  usualPeak,
} from "../../src/trunnion/views/web/data.js";
import {
  fixed,
  number,
  prefixed,
  quantity,
  roundBelow,
  stated,
  tickLabel,
  ticks,
} from "../../src/trunnion/views/web/format.js";
import { arrow, bentArrow, longest } from "../../src/trunnion/views/web/arrow.js";
import { command } from "../../src/trunnion/views/web/player.js";

const cases = JSON.parse(readFileSync(new URL("number_cases.json", import.meta.url), "utf8"));
const joined = (text) => text.replaceAll(" ", "\u00a0");

test("numbers read as they do in Python", () => {
  for (const [peak, unit, factor, shown] of cases.prefixed) {
    const got = prefixed(peak, unit);
    assert.equal(got.unit, shown);
    assert.ok(Math.abs(got.factor / factor - 1) < 1e-12);
  }
  for (const [value, text] of cases.number) assert.equal(number(value), text);
  for (const [value, unit, text] of cases.quantity) assert.equal(joined(quantity(value, unit)), text);
});

test("a running figure keeps its unit and decimals", () => {
  assert.equal(joined(quantity(12.3, "N m", 18750)), "0.01\u00a0kN\u00a0m");
  assert.equal(fixed(-0.0001, 100), "0.0");
  assert.equal(stated(1000, "N"), "1\u00a0kN");
  assert.equal(stated(2.5, "m"), "2.5\u00a0m");
});

test("ticks are round, inside, and labelled without surplus digits", () => {
  assert.deepEqual(ticks(0, 360, 9, true), [0, 45, 90, 135, 180, 225, 270, 315, 360]);
  assert.deepEqual(ticks(-6.4, 5.9, 6), [-5, -2.5, 0, 2.5, 5]);
  assert.deepEqual(ticks(1, 1), [1]);
  assert.equal(tickLabel(2.5, 2.5), "2.5");
  assert.equal(tickLabel(-50, 25), "−50");
  assert.equal(tickLabel(0.25, 0.25), "0.25");
  assert.equal(tickLabel(1e-17, 0.1), "0.0");
  assert.equal(roundBelow(0.37), 0.2);
  assert.equal(roundBelow(5), 5);
});

test("series of one number hold everywhere, gaps stay gaps", () => {
  assert.equal(at([7], 3), 7);
  assert.equal(at([], 3), null);
  assert.deepEqual(magnitude({ x: [3, null], y: [4] }, 2), [5, null]);
  assert.deepEqual(
    total(
      [
        [1, 2],
        [10, null],
      ],
      2,
    ),
    [11, null],
  );
  assert.deepEqual(gaps({ count: 6, status: [0, 6, 6, 1, 4, 0] }), [
    [1, 2],
    [4, 4],
  ]);
});

test("over a closed turn the end is as near as the start", () => {
  const turn = { values: [0, 90, 180, 270], closed: true, period: 360 };
  assert.equal(nearest(turn, 350), 0);
  assert.equal(nearest({ ...turn, closed: false }, 350), 3);
  assert.deepEqual(domain(turn), [0, 360]);
  assert.deepEqual(domain({ values: [0, -90, -180, -270], closed: true, period: -360 }), [-360, 0]);
  assert.deepEqual(domain({ values: [5], closed: false }), [4.5, 5.5]);
});

test("geometry", () => {
  assert.equal(
    hull([
      [0, 0],
      [4, 0],
      [0, 4],
      [1, 1],
    ]).length,
    3,
  );
  assert.equal(bounds({ points: { "a.A": { x: [null], y: [null] } }, gears: [] }), null);
  assert.deepEqual(bounds({ points: { "a.A": { x: [1], y: [0, 2] } }, gears: [{ at: "a.A", radius: 3 }] }), {
    x: -2,
    y: -3,
    width: 6,
    height: 8,
  });
  assert.equal(arrow(0, 0, 0, 0), "");
  assert.match(arrow(0, 0, 30, 0), /^M0.0,0.0L20.0,0.0M30.0,0.0/);
});

test("arrows", () => {
  const room = { left: 0, right: 100, top: 0, bottom: 50 };
  assert.equal(longest([[50, 25, 10, 0]], room), 5);
  assert.equal(longest([[50, 25, 10, 0], [50, 25, 0, -10], [10, 25, -20, 0]], room), 0.5); // prettier-ignore
  assert.equal(longest([], room), Infinity);
  const [left, right] = [bentArrow(20, 1), bentArrow(20, -1)];
  assert.match(left.shaft, /0 1 0/); // counter-clockwise on the screen, its head at the left
  assert.match(left.head, /^M-20.0/);
  assert.match(right.shaft, /0 1 1/);
  assert.match(right.head, /^M20.0/);
});

test("a page has one unit for a quantity", () => {
  const units = { W: [1, "W"], N: [1e-3, "kN"] };
  const shown = [[0.1136, "W"], [0.004, "W"], [2e4, "W"], [-950, "N"], [3, "N m"]].map(([value, unit]) => quantity(value, unit, value, units));
  assert.deepEqual(shown, ["0.1136\u00a0W", "4.000\u00a0mW", "20.00\u00a0kW", "−0.9500\u00a0kN", "3.000\u00a0N\u00a0m"].map((text) => text.replace("N\u00a0m", "N m")));
});

test("feet and pounds have no prefix", () => {
  const units = { N: [1 / 4.4482216152605, "lbf"] };
  assert.equal(quantity(0.0044482216152605, "N", undefined, units), "0.001000\u00a0lbf");
  assert.equal(quantity(44482.216152605, "N", undefined, units), "10\u202f000\u00a0lbf");
});

test("places of the drive in words", () => {
  assert.equal(say({ abscissa: { values: [32], unit: "°" } }, 0), "32°");
  assert.equal(say({ abscissa: { values: [12.5], unit: "mm" } }, 0), "12.5\u00a0mm");
  assert.equal(say({ abscissa: { values: [-7], unit: "" } }, 0), "−7");
});

test("keys", () => {
  assert.equal(command("ArrowRight", false, 5, 359), 6);
  assert.equal(command("ArrowLeft", true, 5, 359), -5);
  assert.equal(command("Home", false, 5, 359), 0);
  assert.equal(command("End", false, 5, 359), 359);
  assert.equal(command(" ", false, 5, 359), "toggle");
  assert.equal(command("a", false, 5, 359), null);
});

test("only a peak next to a dead centre does not set the scale", () => {
  const beside = { ease: [...Array(99).fill(1), 0.01] };
  assert.equal(usualPeak({ ease: [1] }, [1, -2, 3, null]), 3);
  assert.equal(usualPeak({ ease: [1] }, [...Array(99).fill(1), 1000]), 1000);
  assert.equal(usualPeak(beside, [...Array(99).fill(1), 1000]), 1.25);
  assert.equal(usualPeak(beside, [...Array(99).fill(1), 3]), 3);
  assert.equal(usualPeak({ ease: [...Array(99).fill(1), 0.5] }, [...Array(99).fill(1), 1000]), 1000); // a load at work
  assert.equal(usualPeak({}, []), 0);
});
