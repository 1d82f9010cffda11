// How the station is, asked for again and again while the page is looked at.
import { ref, shallowRef } from "vue";
import { asked, data, Lost } from "covista/ask.js";
import { clock } from "covista/moments.js";
import { pulse } from "covista/pulse.js";
import { Samples } from "covista/samples.js";

const EVERY_MS = 2000;

// For `setup`: the newest answer (null before the first) and when it came, all answers of the last minutes, and why
// there is none.
export function useHealth() {
  const now = shallowRef(null);
  const at = ref("");
  const trouble = ref("");
  const samples = new Samples();
  pulse(async () => {
    const answer = await asked(data("/health"));
    samples.take(answer, performance.now());
    at.value = clock(Date.now());
    // Last: what looks at the samples does so when this changes.
    now.value = answer;
  }, EVERY_MS, (error) => {
    // Once something is shown, the top of the page says that no answer comes.
    trouble.value = !error || (now.value && error instanceof Lost) ? "" : `${error.message}.`;
  });
  return { now, at, trouble, samples };
}
