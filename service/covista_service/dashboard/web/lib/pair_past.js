// The overlap of a pair over the last minutes: read once page by page, then what has come since.
import { shallowRef, watch } from "vue";
import { asked, rest } from "covista/ask.js";
import { isId } from "covista/pair_facts.js";
import { pulse, toTop } from "covista/pulse.js";

const EVERY_MS = 2000;
const PAGE = 1000;
// A pair of which more is kept within the span has its newest left out for this time.
const MOST_PAGES = 12;
// What is not written yet comes with one of the next questions.
const LATE_MS = 15000;
// A chart is of so long at least.
const LEAST_MS = 30000;

const momentOf = ({ time, overlap_a, overlap_b, found_by }) => ({ key: time, ms: Date.parse(time), a: overlap_a, b: overlap_b, foundBy: found_by });
const gapOf = ({ since, until, lost, reason }) => ({
  from: Date.parse(since), to: Date.parse(until),
  words: `${lost ? `${lost} entries are` : "Some entries may be"} missing: ${reason}`,
});

// Moments in the order of time, each once; what was read again counts.
function joined(held, found, from) {
  const all = new Map(held.map((each) => [each.key, each]));
  for (const each of found) all.set(each.key, each);
  const sorted = [...all.values()].sort((p, q) => p.ms - q.ms);
  // The last before the span says what was when it began.
  const first = sorted.findLastIndex((each) => each.ms <= from);
  return sorted.slice(Math.max(0, first));
}

// All that is kept from a time on, page by page.
async function read(a, b, since) {
  const found = { items: [], gaps: [] };
  let cursor = "";
  for (let page = 0; page < MOST_PAGES && cursor !== null; page++) {
    const from = encodeURIComponent(new Date(since).toISOString());
    const more = cursor ? `&cursor=${cursor}` : "";
    const { items, gaps: missing, next } = await asked(rest(`/pairs/${a}/${b}/history?limit=${PAGE}&from=${from}${more}`));
    found.items.push(...items);
    found.gaps.push(...missing);
    cursor = next;
  }
  return found;
}

// For `setup`: `past` is { moments, gaps, from, to } or null, `problem` why there is none. `pair` is a ref of [a, b],
// `minutes` a ref, and `aheadMs` one of how far the station's clock is ahead of this one, null as long as that is not known.
export function usePairPast(pair, minutes, aheadMs) {
  const past = shallowRef(null);
  const problem = shallowRef(null);
  let held = [];
  let gaps = [];
  let readTo = null;
  let of = "";

  const tell = toTop();
  const beat = pulse(async () => {
    const [a, b] = pair.value ?? [];
    if (!isId(a) || !isId(b) || a === b || aheadMs.value === null) return;
    const wanted = `${a} ${b} ${minutes.value}`;
    const now = Date.now() + aheadMs.value;
    const start = now - 60000 * minutes.value;
    if (wanted !== of) [held, gaps, readTo, of] = [[], [], null, wanted];
    try {
      const found = await read(a, b, readTo === null ? start : readTo - LATE_MS);
      if (wanted !== of) return;
      held = joined(held, found.items.map(momentOf), start);
      gaps = [...new Map([...gaps, ...found.gaps.map(gapOf)].map((gap) => [`${gap.from} ${gap.to}`, gap])).values()];
      readTo = now;
      // What is kept may begin later than was asked for.
      const from = held.length ? Math.max(start, Math.min(held[0].ms, now - LEAST_MS)) : start;
      past.value = { moments: held, gaps, from, to: Math.max(now, held.at(-1)?.ms ?? 0) };
      problem.value = null;
    } catch (error) {
      if (error.status) problem.value = error;
      throw error;
    }
  }, EVERY_MS, (error) => tell(error?.status ? null : error));
  watch([pair, minutes], ([now, span], [before, spanBefore]) => {
    if (String(now) === String(before) && span === spanBefore) return;
    past.value = null;
    problem.value = null;
    of = "";
    beat();
  });
  watch(() => aheadMs.value === null, beat);
  return { past, problem };
}
