// Asks the station. Everything that a page shows comes this way: nothing is pushed to it.
import { reactive } from "vue";

// The station's own root, whatever it stands behind.
export const root = new URL(import.meta.url).pathname.replace(/\/dashboard\/_nicegui\/.*$/, "");
export const rest = (path) => `${root}/api/v1${path}`;
export const data = (path) => `${root}/dashboard/data${path}`;
export const page = (path) => `${root}/dashboard${path}`;

const SEEN = "covista-station";
const RESTARTED = "covista-restarted";

// How asking goes: shown at the top of every page.
export const standing = reactive({ lostSince: null, station: null, restartedAt: noted(), loggedOut: false, troubles: new Map() });

const TIMEOUT_MS = 10000;
// One answer that is late says nothing of a station that gives others.
const LOST_MS = 3000;
let heardMs = Date.now();
document.addEventListener("visibilitychange", () => {
  // A hidden page asks nothing, and misses no answer.
  if (!document.hidden && standing.lostSince === null) heardMs = Date.now();
});

// What the station answers where it refuses: a problem (RFC 9457).
export class Refused extends Error {
  constructor(status, problem) {
    super(problem.detail || problem.title || `the station answered ${status}`);
    this.status = status;
    this.problem = problem;
  }
}

// Nothing came back, or not all of it: what was asked for may have been done all the same.
export class Lost extends Error {}

// The answer, as JSON or as `kind` says; null where it is still that of `tag` (see `tagged`).
export async function ask(url, { method = "GET", body, headers = {}, kind = "json", timeoutMs = TIMEOUT_MS } = {}) {
  let [response, value] = [null, null];
  try {
    response = await fetch(url, {
      method,
      body: body === undefined ? undefined : JSON.stringify(body),
      headers: body === undefined ? headers : { "content-type": "application/json", ...headers },
      credentials: "same-origin",
      redirect: "error",
      signal: AbortSignal.timeout(timeoutMs),
    });
    heard();
    if (response.ok) value = await response[kind]();
  } catch {
    if (Date.now() - heardMs >= LOST_MS) standing.lostSince ??= heardMs;
    throw new Lost("the station does not answer");
  }
  if (response.status === 304) return null;
  if (!response.ok) {
    const problem = await response.json().catch(() => ({}));
    if (response.status === 401) standing.loggedOut = true;
    throw new Refused(response.status, problem);
  }
  return { value, tag: response.headers.get("etag") };
}

function heard() {
  heardMs = Date.now();
  standing.lostSince = null;
}

export const asked = async (url, options) => (await ask(url, options)).value;

// A question that is asked again and again, where most answers are the last one: `changed` hears of new ones.
export function tagged(url, changed, options = {}) {
  let tag = null;
  return async () => {
    const found = await ask(url, { ...options, headers: { ...options.headers, ...(tag ? { "if-none-match": tag } : {}) } });
    if (found === null) return;
    tag = found.tag;
    changed(found.value);
  };
}

// A restart is told of until it is heard of (null): pages are loaded anew after one.
export function noteRestart(at) {
  standing.restartedAt = at;
  if (at) sessionStorage.setItem(RESTARTED, at.getTime());
  else sessionStorage.removeItem(RESTARTED);
}

function noted() {
  const kept = sessionStorage.getItem(RESTARTED);
  return kept ? new Date(Number(kept)) : null;
}

// Notes which start of the station answers: after another one all that was shown may be old.
export function heardOf(station) {
  const before = sessionStorage.getItem(SEEN);
  if (before && before !== station) noteRestart(new Date());
  sessionStorage.setItem(SEEN, station);
  standing.station = station;
}
