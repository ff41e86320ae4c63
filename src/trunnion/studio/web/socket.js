// Questions to Python and their answers: a JSON header with float32 columns behind it. A late answer is dropped.

/** @typedef {Record<string, any>} Answer */

const AGAIN = 800; // ms until a lost connection is tried again
const TOKEN = "trunnion studio token";

/** What the server knows this page by; it stays that of the server that the page came from. */
let token = "";

/** Take the token that the document came with and keep it, else that which was kept; its address goes out of sight. */
export function enter() {
  token = /** @type {HTMLMetaElement} */ (document.querySelector("meta[name=token]")).content;
  if (!token) token = inStores((store) => store.getItem(TOKEN)).find(Boolean) ?? "";
  else if (inStores((store) => (store.setItem(TOKEN, token), true)).some(Boolean)) history.replaceState(null, "", location.pathname);
}

/** What comes of an act in the storage that all tabs share, and in that of this tab: the first may be full, both may be off. */
function inStores(act) {
  return ["localStorage", "sessionStorage"].map((name) => {
    try {
      return act(window[name]);
    } catch {
      return null;
    }
  });
}

/** Whether the page stands in a cell of a notebook, whose kernel answers in place of a server. */
const inCell = () => document.querySelector("meta[name=cell]") !== null;
/** A name that no other tab or frame has; a page that came by http from another machine has no randomUUID. */
export const unique = () => crypto.randomUUID?.() ?? Array.from(crypto.getRandomValues(new Uint32Array(4)), (one) => one.toString(36)).join("-");
const FRAME = unique();
const posted = new Map();

/** Send what the kernel answers with {status, body}, through the notebook around this frame. */
function post(/** @type {object} */ message) {
  if (!posted.size) window.addEventListener("message", received); // once: the same listener is not added twice
  const id = `${FRAME} ${posted.size}`;
  window.parent.postMessage({ trunnion: id, ...message }, "*");
  return new Promise((resolve) => posted.set(id, resolve));
}

function received({ source, data }) {
  if (source !== window.parent || !data?.trunnion) return;
  posted.get(data.trunnion)?.(data);
  posted.set(data.trunnion, null); // its number is not used again
}

/** Fetch what only the page may have. */
export async function request(/** @type {string} */ path, /** @type {RequestInit} */ how = {}) {
  if (inCell()) {
    const { status, body } = await post({ path, method: how.method ?? "GET", body: how.body ?? null });
    return new Response(body, { status });
  }
  return fetch(path, { ...how, headers: { Authorization: `Bearer ${token}` } });
}

/** An answer's header with its columns as arrays, null for what is no number; `body` are the bytes behind the header. */
export function decode(/** @type {ArrayBuffer} */ buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  const from = 4 + size;
  const floats = new Float32Array(buffer, from, Math.floor((buffer.byteLength - from) / 4));
  return { ...unpacked(header, floats), body: new Uint8Array(buffer, from) };
}

function unpacked(part, floats) {
  if (part === null || typeof part !== "object") return part;
  if (Array.isArray(part)) return part.map((one) => unpacked(one, floats));
  const keys = Object.keys(part);
  if (keys.length === 1 && keys[0] === "column") {
    const [first, count] = part.column;
    return Array.from(floats.subarray(first, first + count), (value) => (Number.isFinite(value) ? value : null));
  }
  if (keys.length === 1 && keys[0] === "sum") {
    const [first, count] = part.sum;
    return Array.from({ length: count }, (_, index) => floats[first + index] + floats[first + count + index]).map((value) => (Number.isFinite(value) ? value : null));
  }
  if (keys[0] === "grid") {
    let [first, count] = part.grid;
    const number = (value) => (Number.isFinite(value) ? value : null);
    const column = () => (count === 1 ? [number(floats[first++])] : Array.from(floats.subarray(first, (first += count)), number));
    return Object.fromEntries(part.keys.map((key) => [key, part.names ? Object.fromEntries(part.names.map((name) => [name, column()])) : column()]));
  }
  return Object.fromEntries(keys.map((key) => [key, unpacked(part[key], floats)]));
}

/**
 * A connection that comes back by itself; `onState(open)` tells of it.
 * `ask(kind, fields)` gives the answer, or null where a newer question of its kind or a lost connection overtook it.
 */
export function connection(/** @type {(open: boolean) => void} */ onState) {
  const revisions = {};
  const waiting = {};
  let socket;
  let ready;

  const open = () => {
    if (inCell()) return void (ready = Promise.resolve().then(() => onState(true)));
    socket = new WebSocket(`ws://${location.host}/socket`, ["trunnion", token]);
    socket.binaryType = "arraybuffer";
    ready = new Promise((resolve) => socket.addEventListener("open", resolve));
    socket.addEventListener("open", () => onState(true));
    socket.addEventListener("message", ({ data }) => {
      let answer;
      try {
        answer = decode(data);
      } finally {
        if (!answer) drop(); // nobody waits for what cannot be read
      }
      settle(answer);
    });
    socket.addEventListener("close", () => {
      onState(false);
      drop();
      setTimeout(open, AGAIN);
    });
  };
  const finish = (kind, answer) => {
    const one = waiting[kind];
    delete waiting[kind];
    one?.resolve(answer);
  };
  const drop = () => Object.keys(waiting).forEach((kind) => finish(kind, null));
  const settle = (/** @type {Answer} */ answer) => {
    if (waiting[answer.ask]?.revision === answer.revision) finish(answer.ask, answer);
  };
  const send = (question) => (inCell() ? post({ question }).then(({ body }) => settle(decode(body))) : socket.send(question));
  open();
  return {
    /** @returns {Promise<Answer | null>} */
    async ask(kind, fields) {
      const revision = (revisions[kind] = (revisions[kind] ?? 0) + 1);
      finish(kind, null);
      const answer = new Promise((resolve) => (waiting[kind] = { revision, resolve }));
      const question = JSON.stringify({ ask: kind, revision, ...fields });
      if (socket?.readyState === WebSocket.OPEN) send(question); // at once: what is drawn next may take a while
      else ready.then(() => waiting[kind]?.revision === revision && send(question));
      return answer; // a connection that is lost answers with null, though it may never have been there
    },
  };
}
