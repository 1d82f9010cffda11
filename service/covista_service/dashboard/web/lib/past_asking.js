// Groups over time and what happened then: asked for once, then only what is new. Never more than a page can show.
import { ref, shallowRef } from "vue";
import { asked, data, rest } from "covista/ask.js";
import { pulse } from "covista/pulse.js";

const EVERY_MS = 2000;
const PAGE = 500;
const MOST_PAGES = 3;
const MOST_ASKED = 30;
// What was written a little late is not to be missed.
const AGAIN_MS = 5000;
const MOST_EVENTS = 400;

const iso = (ms) => new Date(ms).toISOString();

function eventsUrl(sinceMs, untilMs, { kinds, robot }, cursor) {
  const query = new URLSearchParams({ from: iso(sinceMs), to: iso(untilMs), limit: PAGE });
  kinds.forEach((kind) => query.append("kind", kind));
  if (robot) query.set("robot", robot);
  if (cursor) query.set("cursor", cursor);
  return rest(`/events/history?${query}`);
}

// The newest events of a time, the oldest of them first: pages go forward, so it goes back in steps that grow, and
// shrink where much happened. `reachesMs` is how far back they go.
export async function newestEvents(sinceMs, untilMs, which, most = MOST_EVENTS) {
  if (!which.kinds.length) return { items: [], reachesMs: sinceMs };
  let [end, width, found, questions] = [untilMs, Math.min(untilMs - sinceMs, 300000), [], 0];
  while (end > sinceMs && found.length < most && questions < MOST_ASKED) {
    const begin = Math.max(sinceMs, end - width);
    let [items, cursor, pages] = [[], null, 0];
    do {
      const page = await asked(eventsUrl(begin, end, which, cursor));
      questions += 1;
      pages += 1;
      items = items.concat(page.items);
      cursor = page.next;
    } while (cursor && pages < MOST_PAGES);
    if (cursor && end - begin > 2000) {
      width = (end - begin) / 4;
      continue;
    }
    found = items.concat(found);
    end = begin;
    width *= 3;
  }
  return { items: found.slice(-most), reachesMs: found.length > most ? Date.parse(found.at(-most).time) : end };
}

// Bands as known, with what came since.
function joined(known, news) {
  const runs = {};
  for (const robot of new Set([...Object.keys(known.runs), ...Object.keys(news.runs)])) {
    const kept = (known.runs[robot] ?? []).filter(([ms]) => ms < news.since_ms);
    for (const [ms, label] of news.runs[robot] ?? []) {
      if (!kept.length || kept.at(-1)[1] !== label) kept.push([ms, label]);
    }
    if (kept.length) runs[robot] = kept;
  }
  const fresh = news.robots.filter((robot) => !known.robots.includes(robot));
  const gaps = [...known.gaps.filter((gap) => gap.since_ms < news.since_ms), ...news.gaps.filter((gap) => gap.since_ms >= news.since_ms)];
  return { ...known, runs, gaps, robots: [...known.robots, ...fresh], until_ms: news.until_ms, now_ms: news.now_ms };
}

// For `setup`. `span` is a function that gives { spanMs, untilMs } (null: until now), `kinds` one that gives names.
export function usePast(span, kinds) {
  const bands = shallowRef(null);
  const events = shallowRef({ items: [], reachesMs: 0 });
  const problem = ref("");
  // The station's clock is not that of who looks.
  const aheadMs = ref(0);
  let [asking, loadedMs, askedKinds] = [null, 0, ""];

  async function load({ spanMs, untilMs }) {
    const until = untilMs === null ? "" : `&until_ms=${Math.round(untilMs)}`;
    const found = await asked(data(`/bands?span_s=${spanMs / 1000}${until}`));
    aheadMs.value = found.now_ms - Date.now();
    bands.value = found;
    loadedMs = Date.now();
    askedKinds = kinds().join();
    events.value = await newestEvents(found.since_ms, found.until_ms, { kinds: kinds() });
  }

  // Who stops it where it stands has all that is wanted.
  const stands = ({ spanMs, untilMs }) =>
    bands.value !== null && askedKinds === kinds().join() && untilMs === bands.value.until_ms && spanMs === untilMs - bands.value.since_ms;

  async function follow({ spanMs }) {
    const known = bands.value;
    const since = known.until_ms - AGAIN_MS;
    const news = joined(known, await asked(data(`/bands?since_ms=${since}`)));
    const seen = new Set(events.value.items.map((event) => event.id));
    const { items } = await newestEvents(since, news.until_ms + 1000, { kinds: kinds() });
    const fresh = items.filter((event) => !seen.has(event.id));
    // Meanwhile it may have been stopped.
    if (span().untilMs !== null) return;
    aheadMs.value = news.now_ms - Date.now();
    bands.value = { ...news, since_ms: news.until_ms - spanMs };
    if (fresh.length) events.value = { ...events.value, items: [...events.value.items, ...fresh].slice(-MOST_EVENTS) };
  }

  const beat = pulse(
    async () => {
      const wanted = span();
      const key = JSON.stringify(wanted);
      const old = Date.now() - loadedMs > Math.max(60000, wanted.spanMs / 100);
      if (stands(wanted)) asking = key;
      else if (key !== asking || askedKinds !== kinds().join() || (old && wanted.untilMs === null)) {
        await load(wanted);
        asking = key;
      } else if (wanted.untilMs === null) await follow(wanted);
    },
    // What was chosen meanwhile is asked for at once.
    () => (JSON.stringify(span()) !== asking || askedKinds !== kinds().join() ? 50 : EVERY_MS),
    (error) => (problem.value = error ? error.message : ""),
  );
  return { bands, events, problem, aheadMs, beat };
}
