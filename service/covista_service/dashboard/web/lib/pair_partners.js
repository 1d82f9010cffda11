// Which other robots there are, and the way to the pages of other pairs.
import { computed, shallowRef } from "vue";
import { page, rest, tagged } from "covista/ask.js";
import { byName } from "covista/looks.js";
import { pulse } from "covista/pulse.js";

const EVERY_MS = 3000;

// For `setup`, of a pair a and b that stands: `before` and `after` are who comes next to b, beside a, or null.
export function usePartners(a, b) {
  const names = shallowRef([]);
  pulse(tagged(rest("/groups"), ({ groups, ungrouped }) => {
    names.value = [...groups.flatMap((group) => group.robots), ...ungrouped.map((each) => each.robot)].sort(byName);
  }), EVERY_MS);
  const beside = (step) => {
    const others = names.value.filter((name) => name !== a);
    if (others.length < 2) return null;
    const at = others.indexOf(b);
    if (at < 0) return others.at(step < 0 ? -1 : 0);
    return others[(at + step + others.length) % others.length];
  };
  const before = computed(() => beside(-1));
  const after = computed(() => beside(1));
  const go = (one, other) => location.assign(page(`/pairs/${one}/${other}`));
  const options = (mine) => (names.value.includes(mine) ? names.value : [mine, ...names.value]);
  return { before, after, go, options };
}
