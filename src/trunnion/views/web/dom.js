// Building the page: elements from names, attributes and text. Data only ever becomes text or attribute values.

const SVG = "http://www.w3.org/2000/svg"; // the name of the language, not an address to fetch

/** An SVG element with attributes and children. */
export function svg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

/** An HTML element with attributes and children. */
export function html(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** Set attributes; null removes one. What is set again as it is would be styled and painted again. */
export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    const text = value === null || value === undefined || value === false ? null : value === true ? "" : String(value);
    if (text === element.getAttribute(name)) continue;
    if (text === null) element.removeAttribute(name);
    else element.setAttribute(name, text);
  }
  return element;
}

function fill(element, attributes, children) {
  set(element, attributes);
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** A figure: its title, unit and, if it has one, running value over its parts. */
export function figure(kind, title, unit, value, ...parts) {
  const words = [html("span", { class: "title" }, title), html("span", { class: "unit" }, unit && `[${unit}]`), value];
  return html("figure", { class: kind }, html("figcaption", {}, ...words), ...parts);
}

let clips = 0; // clip paths need names that are unique in the page

/** Children of a drawing, cut at the box {x, y, width, height}. */
export function clipped(box, ...children) {
  const id = `clip-${(clips += 1)}`;
  return svg("g", {}, svg("clipPath", { id }, svg("rect", box)), svg("g", { "clip-path": `url(#${id})` }, ...children));
}

/** What is drawn anew for paper; held weakly, or a page that is solved many times would keep all its pictures. */
const pictures = new Set();

function forPaper(kind) {
  for (const reference of pictures) {
    const picture = reference.deref();
    if (!picture) pictures.delete(reference);
    else if (kind) picture[kind]();
  }
}

const paper = { beforeprint: () => forPaper("beforeprint"), afterprint: () => forPaper("afterprint") };

/** Call `beforeprint()` and `afterprint()` of a picture as long as something else holds it. */
export function onPaper(picture) {
  for (const kind of ["beforeprint", "afterprint"]) window.addEventListener(kind, paper[kind]); // the same one is not added twice
  forPaper(null);
  pictures.add(new WeakRef(picture));
}

/** Call `draw(width)` now, whenever the width of the element changes, and with `printed` px before printing. */
export function onWidth(element, draw, printed) {
  let last = 0;
  const chart = {
    measure() {
      const width = Math.round(element.clientWidth);
      if (width > 0 && width !== last) draw((last = width));
    },
    // The width on paper is only known once it is too late to draw; the drawing is scaled from `printed` to it.
    beforeprint() {
      observer.disconnect();
      draw(printed);
    },
    afterprint() {
      last = 0;
      observer.observe(element);
    },
  };
  // In the next frame: drawing changes heights, and an observer must not change what it observes. It keeps the chart.
  const observer = new ResizeObserver(() => requestAnimationFrame(chart.measure));
  observer.observe(element);
  onPaper(chart);
  chart.measure();
}
