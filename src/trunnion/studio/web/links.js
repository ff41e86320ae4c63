// A small model as a link: its text, compressed, behind `#m=` of the studio's address; it stays in the browser.

const MOST_SIGNS = 300_000; // of the text, as the studio reads at most
export const LONGEST = 16_000; // signs of a link that is made: what mail programs and browsers carry along
const LONGEST_TAKEN = 120_000; // of a link that is opened
const MARK = "#m=";

/** The link of a text at the page's address; an Error with words if it would be too long. */
export async function linkOf(/** @type {string} */ text, /** @type {string} */ address) {
  const packed = await through(new TextEncoder().encode(text), new CompressionStream("deflate-raw"), Infinity);
  const signs = btoa(Array.from(packed, (byte) => String.fromCharCode(byte)).join(""));
  const link = `${address.split("#")[0]}${MARK}${signs.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "")}`;
  if (link.length > LONGEST) throw new Error(`The link would have ${link.length.toLocaleString("en")} signs, ${LONGEST.toLocaleString("en")} at most; hand over the file instead.`);
  return link;
}

/** Whether an address carries a model. */
export const carries = (/** @type {string} */ address) => address.includes(MARK);

/** The text that a link carries; an Error with words if it carries none. */
export async function textOf(/** @type {string} */ address) {
  const signs = address.slice(address.indexOf(MARK) + MARK.length);
  if (signs.length > LONGEST_TAKEN) throw new Error(`The link has ${signs.length.toLocaleString("en")} signs; ${LONGEST_TAKEN.toLocaleString("en")} at most are read.`);
  if (!/^[\w-]+$/.test(signs)) throw new Error("The link is not one of the studio: it has signs that no link has.");
  let text;
  try {
    const bytes = Uint8Array.from(atob(signs.replaceAll("-", "+").replaceAll("_", "/")), (sign) => sign.charCodeAt(0));
    text = new TextDecoder("utf-8", { fatal: true }).decode(await through(bytes, new DecompressionStream("deflate-raw"), 4 * MOST_SIGNS));
  } catch (problem) {
    if (problem instanceof RangeError) throw new Error(`The link holds a model of more than ${MOST_SIGNS.toLocaleString("en")} signs, which the studio does not read.`);
    throw new Error("The link is damaged: perhaps a part of it was lost on the way.");
  }
  if (text.length > MOST_SIGNS) throw new Error(`The link holds a model of more than ${MOST_SIGNS.toLocaleString("en")} signs, which the studio does not read.`);
  return text;
}

/** Bytes through a stream, no more than `most`: a few signs may hold gigabytes. RangeError for more. */
async function through(/** @type {Uint8Array<ArrayBuffer>} */ bytes, /** @type {CompressionStream | DecompressionStream} */ stream, /** @type {number} */ most) {
  const reader = new Blob([bytes]).stream().pipeThrough(stream).getReader();
  const parts = [];
  let size = 0;
  for (let { done, value } = await reader.read(); !done && value; { done, value } = await reader.read()) {
    size += value.length;
    if (size > most) {
      reader.cancel().catch(() => {});
      throw new RangeError("too much");
    }
    parts.push(value);
  }
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}
