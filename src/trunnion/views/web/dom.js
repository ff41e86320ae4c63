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

/** Set attributes; null removes one. */
export function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) element.removeAttribute(name);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  return element;
}

function fill(element, attributes, children) {
  set(element, attributes);
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

let clips = 0; // clip paths need names that are unique in the page

/** Children of a drawing, cut at the box {x, y, width, height}. */
export function clipped(box, ...children) {
  const id = `clip-${(clips += 1)}`;
  return svg("g", {}, svg("clipPath", { id }, svg("rect", box)), svg("g", { "clip-path": `url(#${id})` }, ...children));
}

/** Call `draw(width)` now, whenever the width of the element changes, and with `printed` px before printing. */
export function onWidth(element, draw, printed) {
  let last = 0;
  const measure = () => {
    const width = Math.round(element.clientWidth);
    if (width > 0 && width !== last) draw((last = width));
  };
  // In the next frame: drawing changes heights, and an observer must not change what it observes.
  const observer = new ResizeObserver(() => requestAnimationFrame(measure));
  observer.observe(element);
  // The width on paper is only known once it is too late to draw; the drawing is scaled from `printed` to it.
  window.addEventListener("beforeprint", () => {
    observer.disconnect();
    draw(printed);
  });
  window.addEventListener("afterprint", () => {
    last = 0;
    observer.observe(element);
  });
  measure();
}
