// The whole page in a document that only remembers: every view is built, moved through all positions and printed.
// Run by test_browser.py, with a scene as its argument.
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
  find(test) {
    const below = this.children.flatMap((child) => (child instanceof Element ? child.find(test) : []));
    return test(this) ? [this, ...below] : below;
  }
}

const events = {};
globalThis.window = {
  innerWidth: 1400,
  innerHeight: 800,
  addEventListener: (name, act) => (events[name] ??= []).push(act),
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
const places = Object.fromEntries(["stage", "charts", "polars"].map((name) => [name, new Element(name)]));
const crank = start(scene, places);
for (let index = 0; index < scene.count; index += 1) crank.go(index);
for (const name of ["beforeprint", "afterprint"]) events[name].forEach((act) => act());
const classes = (name) => (element) => element.attributes.class?.split(" ").includes(name);
const seen = (place, name) => places[place].find(classes(name)).length;
console.log(
  JSON.stringify({
    charts: seen("charts", "chart"),
    polars: seen("polars", "polar"),
    loads: seen("stage", "load"),
    moments: seen("stage", "arc"),
    springs: places.stage.find(classes("spring")).map((element) => element.attributes.d),
    slits: places.stage.find(classes("slit")).map((element) => element.attributes.d),
    labels: places.stage.find(classes("load")).map((element) => {
      const text = element.find((part) => part.name === "text")[0];
      const shift = Number(/translate\(([-\d.]+),/.exec(element.attributes.transform)[1]);
      return [shift + Number(text.attributes.x), text.attributes.class ?? "", text.textContent];
    }),
    circles: places.stage.find(classes("pitch-circle")).map((element) => element.attributes.r),
    remarks: places.polars.find(classes("remark")).map((element) => element.textContent),
    silent: places.charts.find((element) => element.textContent === "no values" && element.name === "text").length,
    reaction: places.stage.find(classes("reaction")).map((element) => element.attributes.d),
  }),
);
