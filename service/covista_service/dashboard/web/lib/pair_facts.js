// What is known of two robots, asked for when others are chosen and again each second.
import { ref, shallowRef, watch } from "vue";
import { asked, data } from "covista/ask.js";
import { msOf } from "covista/moments.js";
import { pulse } from "covista/pulse.js";

const EVERY_MS = 1000;
// A mouse that crosses a matrix asks for where it rests.
const RESTS_MS = 90;

export const isId = (name) => /^[a-z0-9][a-z0-9_-]{0,62}$/.test(name ?? "");

// For `setup`. `pair` is a ref of [a, b] or null; gives the facts of these two alone (null before they are there), why
// they are no pair for the station, and how far its clock is ahead of this one (null before it has answered).
export function usePairFacts(pair) {
  const facts = shallowRef(null);
  const problem = ref("");
  const aheadMs = ref(null);
  let timer = null;

  async function ask() {
    const [a, b] = pair.value ?? [];
    if (!isId(a) || !isId(b) || a === b) return;
    let found;
    try {
      found = await asked(data(`/pair?a=${a}&b=${b}`));
    } finally {
      // What else goes by the station's clock does not wait for ever.
      aheadMs.value ??= 0;
    }
    aheadMs.value = msOf(found.time) - Date.now();
    if (pair.value?.[0] !== a || pair.value?.[1] !== b) return;
    problem.value = found.problem ?? "";
    facts.value = found.problem ? null : found;
  }

  watch(pair, (now, before) => {
    if (String(now) === String(before)) return;
    if (facts.value?.a !== now?.[0] || facts.value?.b !== now?.[1]) facts.value = null;
    problem.value = "";
    clearTimeout(timer);
    timer = setTimeout(() => ask().catch(() => {}), RESTS_MS);
  });
  pulse(ask, EVERY_MS);
  return { facts, problem, aheadMs };
}
