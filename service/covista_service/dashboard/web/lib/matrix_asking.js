// The matrices of the swarm, and its groups: asked for again and again, a large one seldom.
import { ref, shallowRef, watch } from "vue";
import { rest, tagged } from "covista/ask.js";
import { choose, chosenIn } from "covista/address.js";
import { MATRICES } from "covista/colour_scale.js";
import { matrixOf } from "covista/npy.js";
import { pulse } from "covista/pulse.js";

// How long until a matrix of so many robots is asked for again: one of a thousand has 8 MB.
const PAUSES_MS = [[60, 1000], [200, 2000], [500, 5000], [Infinity, 10000]];
const LONG_MS = 60000;
const GROUPS_MS = 1000;

// For `setup`: the groups, null before the first.
export function useGroups() {
  const groups = shallowRef(null);
  pulse(tagged(rest("/groups"), (found) => (groups.value = found)), GROUPS_MS);
  return groups;
}

// For `setup`: which matrix is chosen (`kind`), what was `told` last ({ kind, robots, values } or null), and why there is
// none now.
export function useMatrix() {
  const kind = ref(chosenIn("matrix") in MATRICES ? chosenIn("matrix") : "similarity");
  const told = shallowRef(null);
  const problem = ref("");
  const asking = Object.fromEntries(Object.keys(MATRICES).map((each) => [each, ask(each)]));
  function ask(each) {
    const url = rest(`/similarity?matrix=${each}`);
    let last = null;
    const beat = tagged(url, (found) => (last = found), { headers: { accept: "application/x-npy" }, kind: "arrayBuffer", timeoutMs: LONG_MS });
    return async () => {
      const before = last;
      await beat();
      // The answer to what was wanted before somebody has chosen another matrix is of no use.
      if (each !== kind.value || !last || (before === last && told.value?.kind === each)) return;
      told.value = { kind: each, ...matrixOf(last) };
    };
  }
  const pause = () => PAUSES_MS.find(([most]) => (told.value?.robots.length ?? 0) <= most)[1];
  const beat = pulse(() => asking[kind.value](), pause, (error) => (problem.value = error ? `The matrix cannot be shown now: ${error.message}. Trying again.` : ""));
  watch(kind, () => {
    choose({ matrix: kind.value });
    beat();
  });
  return { kind, told, problem };
}
