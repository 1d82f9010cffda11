// Both pictures of a pair with its planes, of one moment; loaded anew only when there is something new to see.
import { ref, shallowRef, watch } from "vue";
import { asked, data } from "covista/ask.js";
import { isId } from "covista/pair_facts.js";
import { pulse } from "covista/pulse.js";

// One looks at a picture for a while.
const EVERY_MS = 1500;

// For `setup`. `pair` is a ref of [a, b], `wanted` a ref of "told" (the last moment that told planes), "newest" or
// "held", `known` a ref of whether the station knows the pair; gives { pair, pictures, explained }, null before the first, and how many seconds ago that was.
export function usePairLook(pair, wanted, known) {
  const look = shallowRef(null);
  const sinceS = ref(null);
  const beat = pulse(async () => {
    const [a, b] = pair.value;
    if (!isId(a) || !isId(b) || a === b || (wanted.value === "held" && look.value)) return;
    if (!known.value) return;
    const version = look.value?.version ?? "";
    const found = await asked(data(`/pair/look?a=${a}&b=${b}&newest=${wanted.value === "newest"}&known=${encodeURIComponent(version)}`));
    sinceS.value = found.since_s;
    if (found.pictures) look.value = found;
  }, EVERY_MS);
  watch([wanted, known], beat);
  return { look, sinceS };
}
