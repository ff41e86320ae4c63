// The whole page in a document that only remembers: every view is built, moved through all positions and printed.
// Run by test_scene.py, with a scene as its argument.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

class Element {
  constructor(name) {
    Object.assign(this, { name, attributes: {}, children: [], listeners: {}, clientWidth: 390, hidden: false, value: "" });
    this.classList = { add() {}, toggle() {} };
  }
  setAttribute(name, value) {
    assert.ok(!/NaN|undefined|Infinity/.test(value), `${this.name} ${name}="${value}"`);
    this.attributes[name] = value;
  }
  getAttribute(name) {
    return this.attributes[name] ?? null;
  }
  removeAttribute(name) {
    delete this.attributes[name];
  }
  append(...children) {
    this.children.push(...children);
  }
  replaceChildren(...children) {
    this.children = children;
  }
  addEventListener(name, act) {
    this.listeners[name] = act;
  }
  set textContent(text) {
    assert.ok(!/NaN|undefined|Infinity/.test(text), text);
    this.children = [text];
  }
  get textContent() {
    return this.children.map((child) => child?.textContent ?? child).join("");
  }
  remove() {
    for (const place of Object.values(places)) place.children = place.children.filter((child) => child !== this);
  }
  getBoundingClientRect() {
    return { left: 0, top: 0, width: 390, height: 300 };
  }
  getContext() {
    return new Brush();
  }
  find(test) {
    const below = this.children.flatMap((child) => (child instanceof Element ? child.find(test) : []));
    return test(this) ? [this, ...below] : below;
  }
}

let painted = 0; // facets and lines on the canvas
class Brush {
  beginPath() {}
  closePath() {}
  setTransform() {}
  clearRect() {
    painted = 0;
  }
  moveTo(x, y) {
    assert.ok(Number.isFinite(x) && Number.isFinite(y), `${x}, ${y}`);
  }
  lineTo(x, y) {
    this.moveTo(x, y);
  }
  fill() {
    assert.match(this.fillStyle, /^(rgb|#)/);
  }
  stroke() {
    painted += 1;
  }
}

const events = {};
globalThis.window = {
  innerWidth: 1400,
  innerHeight: 800,
  addEventListener: (name, act) => (events[name] ??= new Set()).add(act),
};
globalThis.ResizeObserver = class {
  observe() {}
  disconnect() {}
};
globalThis.cancelAnimationFrame = () => {};
globalThis.document = Object.assign(new Element("document"), {
  getElementById: () => null,
  createElement: (name) => new Element(name),
  createElementNS: (_, name) => new Element(name),
});

const { start } = await import("../../src/trunnion/views/web/report.js");
const scene = JSON.parse(readFileSync(process.argv[2], "utf8"));
const places = Object.fromEntries(["stage", "charts", "polars", "seats", "events"].map((name) => [name, new Element(name)]));
const crank = start(scene, places);
const classes = (name) => (element) => element.attributes.class?.split(" ").includes(name);
let covered = 0; // names of joints over values of loads, at all positions
for (let index = 0; index < scene.count; index += 1) {
  crank.go(index);
  covered += overlaps();
}
const built = scene.built ? enlarged() : null;
const space = scene.space === "spatial" && scene.solids.length ? steered() : null;
for (const name of ["beforeprint", "afterprint"]) events[name].forEach((act) => act());
const seen = (place, name) => places[place].find(classes(name)).length;

const motion = scene.motion ? played() : null;

const alone = { stage: new Element("stage") }; // an animation has no more than the drawing and its player
start(scene, alone).go(scene.count - 1);
assert.equal(alone.stage.find(classes("player")).length, 1);

/** How many names of joints lie on values of loads. */
function overlaps() {
  const shift = (element) => /translate\(([-\d.]+),([-\d.]+)\)/.exec(element.attributes.transform ?? "")?.slice(1).map(Number);
  const seen = (element) => shift(element) && element.attributes.visibility !== "hidden" && element.attributes.display !== "none";
  const names = places.stage.find(classes("name")).filter(seen).map((name) => {
    const [[x, y], half] = [shift(name), 4 * name.textContent.length];
    return [x - half, x + half, y - 9, y + 2];
  });
  const values = places.stage.find(classes("load")).filter(seen).map((load) => {
    const text = load.find((part) => part.name === "text")[0];
    const [[x, y], wide] = [shift(load), 6.5 * text.textContent.length];
    const left = x + Number(text.attributes.x) - (text.attributes.class ? wide : 0);
    return [left, left + wide, y + Number(text.attributes.y) - 4, y + Number(text.attributes.y) + 4];
  });
  const meet = (one, other) => one[0] < other[1] && one[1] > other[0] && one[2] < other[3] && one[3] > other[2];
  return names.filter((name) => values.some((value) => meet(name, value))).length;
}

/** Lengths of the arrows of loads and of the reference, px, with what they stand for. */
function arrows() {
  const numbers = (path) => path.match(/-?[\d.]+/g).map(Number);
  const long = (path) => {
    const [x, y, , , tipX, tipY] = numbers(path);
    return Math.hypot(tipX - x, tipY - y);
  };
  const loads = places.stage.find(classes("load")).filter((load) => load.find(classes("arc")).length === 0 && load.attributes.display !== "none");
  const key = places.stage.find(classes("reference")).map((path) => long(path.attributes.d));
  const texts = places.stage.find(classes("key"))[0]?.find((part) => part.name === "text").map((part) => part.textContent) ?? [];
  return [
    ...loads.map((load) => [long(load.find((part) => part.name === "path")[0].attributes.d), load.find((part) => part.name === "text")[0].textContent]),
    ...key.map((length) => [length, texts.find((text) => text.startsWith("force")) ?? ""]),
  ];
}

/** What a motion in time shows beside a cycle: its charts, events that are chosen, and what playing it in real time does. */
function played() {
  const { charts, stage, events: table } = places;
  const clicked = scene.motion.events.map(({ at }) => {
    table.listeners.click({ target: { dataset: { time: String((at / scene.abscissa.values.at(-1)) * scene.motion.duration) } } });
    return crank.index();
  });
  table.listeners.click({ target: {} }); // beside the times
  let frame = null;
  globalThis.requestAnimationFrame = (act) => ((frame = act), 1);
  globalThis.performance = { now: () => 0 };
  const speed = stage.find(classes("pace"))[0].find((element) => element.name === "select")[0];
  const chosen = speed.find((element) => element.name === "option" && element.attributes.value === speed.value);
  const seconds = (1000 * scene.motion.duration) / Number(speed.value); // of the clock, ms
  crank.go(crank.last + 5);
  crank.toggle(); // begins again
  const again = crank.index();
  for (let time = 0; time <= 0.5 * seconds; time += seconds / 64) frame(time);
  const half = crank.index();
  for (let time = 0.5 * seconds; time <= 1.2 * seconds && crank.playing(); time += seconds / 64) frame(time);
  return {
    titles: charts.find(classes("title")).map((element) => element.textContent),
    marks: charts.find(classes("event")).length,
    lines: charts.find((element) => element.attributes.class === "event").length,
    words: charts.find((element) => element.attributes.class === "mark middle").map((element) => [
      element.textContent,
      Number(element.attributes.x),
      Number(element.attributes.y),
    ]),
    axes: [...new Set(charts.find(classes("axis")).map((element) => element.textContent.replace(/ \[.*/, "")))],
    clicked,
    speed: chosen[0].textContent,
    last: crank.last,
    played: { again, half, after: crank.index(), playing: crank.playing() },
  };
}

/** What a scene with errors shows of them, at several magnifications through all positions; ends at 1. */
function enlarged() {
  const slider = places.stage.find(classes("magnification"))[0];
  const found = {};
  for (const power of [3, 2, 0]) {
    slider.value = String(power);
    slider.listeners.input();
    for (let index = 0; index < scene.count; index += 1) crank.go(index);
    crank.go(0);
    const move = (element) => /translate\(([-\d.]+),([-\d.]+)\)/.exec(element.attributes.transform).slice(1).map(Number);
    found[10 ** power] = {
      said: places.stage.find(classes("errors")).map((element) => element.textContent),
      output: places.stage.find(classes("factor")).map((element) => element.textContent),
      ideal: places.stage.find(classes("ideal")).length,
      rails: places.stage.find(classes("rail")).map((element) => element.attributes.d),
      pins: places.stage.find(classes("joint")).filter((element) => element.children.some((child) => child?.children?.[0]?.attributes?.class === "pin" || child?.name === "circle")).length,
      apart: places.stage.find(classes("pin")).map((pin) => move(pin)),
      holes: places.stage.find(classes("joint")).flatMap((one) => one.children.filter((child) => child.name === "circle" && child.attributes.class !== "pin" && one.attributes.transform).map((child) => [...move(one), Number(child.attributes.r)])),
      painted,
    };
  }
  const buttons = places.stage.find((element) => element.name === "button" && /^× \d+$/.test(element.textContent));
  const seats = places.seats.find(classes("seat"));
  return {
    at: found,
    presets: buttons.map((button) => button.textContent),
    seats: seats.map((seat) => seat.find(classes("title"))[0].textContent),
    remarks: seats.map((seat) => seat.find(classes("remark"))[0].textContent),
    lost: places.charts.find(classes("lost")).length,
    clear: places.stage.find(classes("clear")).length,
    titles: places.charts.find(classes("title")).map((element) => element.textContent),
  };
}

/** Everything in a spatial scene switched on, turned, shifted and zoomed: what is then seen. */
function steered() {
  const stage = places.stage.find(classes("stage"))[0];
  const at = (x, y, more = {}) => ({ pointerId: 1, clientX: x, clientY: y, buttons: 1, preventDefault() {}, ...more });
  const count = (name) => places.stage.find(classes(name)).length;
  const texts = (name) => places.stage.find(classes(name)).map((element) => element.textContent);
  const triad = () => places.stage.find(classes("triad")).map((element) => element.attributes.d);
  const before = { axes: count("joint-axis"), screws: count("screw"), twists: count("twist"), triad: triad() };
  const boxes = places.stage.find((element) => element.name === "input" && element.attributes.type === "checkbox");
  for (const box of boxes.filter((one) => ["axes", "moments", "screws"].includes(one.attributes.value))) {
    box.checked = true;
    box.listeners.change();
  }
  const after = { axes: count("joint-axis"), screws: count("screw"), twists: count("twist"), names: texts("screw-name") };
  const views = [triad().join()];
  const act = (name, event) => {
    stage.listeners[name](event);
    views.push(triad().join() + places.stage.find(classes("bar"))[0]?.attributes.d + places.stage.find(classes("name"))[0].attributes.x);
  };
  stage.listeners.pointerdown(at(100, 100));
  act("pointermove", at(160, 90));
  act("pointermove", at(170, 120, { shiftKey: true }));
  stage.listeners.pointerup(at(170, 120));
  act("wheel", { deltaY: -240, deltaMode: 0, clientX: 50, clientY: 60, preventDefault() {} });
  for (const key of ["ArrowLeft", "ArrowUp", "+", "0"]) act("keydown", at(0, 0, { key }));
  stage.listeners.keydown(at(0, 0, { key: "x", preventDefault: () => assert.fail("not our key") }));
  const planes = places.polars.find((element) => element.name === "select")[0];
  planes.value = "y–z";
  planes.listeners.change();
  const axes = places.polars.find((element) => element.name === "text").map((element) => element.textContent);
  return { before, after, views, painted, keys: texts("key"), plane: axes.filter((text) => /^F[xyz]$/.test(text)) };
}

console.log(
  JSON.stringify({
    space,
    built,
    motion,
    charts: seen("charts", "chart"),
    polars: seen("polars", "polar"),
    loads: seen("stage", "load"),
    moments: seen("stage", "arc"),
    covered,
    arrows: scene.space === "spatial" ? [] : arrows(),
    cylinders: places.stage.find(classes("cylinder")).map((one) => one.children.map((part) => part.find((path) => path.name === "path")[0].attributes.d)),
    springs: places.stage.find(classes("spring")).map((element) => element.attributes.d),
    dashes: places.stage.find(classes("spring")).map((element) => element.attributes["stroke-dasharray"]),
    slits: places.stage.find(classes("slit")).map((element) => element.attributes.d),
    labels: places.stage.find(classes("load")).map((element) => {
      const text = element.find((part) => part.name === "text")[0];
      const shift = Number(/translate\(([-\d.]+),/.exec(element.attributes.transform ?? "")?.[1] ?? 0);
      return [shift + Number(text.attributes.x), text.attributes.class ?? "", text.textContent];
    }),
    circles: places.stage.find(classes("pitch-circle")).map((element) => element.attributes.r),
    remarks: places.polars.find(classes("remark")).map((element) => element.textContent),
    silent: places.charts.find((element) => element.textContent === "no values" && element.name === "text").length,
    reaction: places.stage.find(classes("reaction")).map((element) => element.attributes.d),
  }),
);
