// What of a matrix is shown: all robots ordered by group, or one group alone, and one pair of them.
import { computed, ref, watch } from "vue";
import { page } from "covista/ask.js";
import { choose, chosenIn } from "covista/address.js";
import { MATRICES, measureOf } from "covista/colour_scale.js";
import { byName } from "covista/looks.js";
import { orderOf } from "covista/matrix_order.js";

// Of more robots than these one may want to see a part.
const MANY = 40;

// For `setup`: `part` is the label of the group that is shown alone, "" for all; `missing` are robots that no matrix has.
export function useShown(told, groups) {
  const part = ref(chosenIn("group") ?? "");
  const matrix = computed(() => {
    if (!told.value) return null;
    const { robots, values, kind: each } = told.value;
    const shown = (groups.value?.groups ?? []).filter(({ label }) => !part.value || label === part.value);
    const { order, blocks } = orderOf(robots, shown);
    const end = part.value ? (blocks.find(({ label }) => label === part.value)?.end ?? order.length) : order.length;
    return {
      robots, values, order: order.slice(0, end), blocks: blocks.filter((block) => block.end <= end),
      measure: measureOf(each, values), title: MATRICES[each].title,
    };
  });
  const names = computed(() => [...(told.value?.robots ?? [])].sort(byName));
  const many = computed(() => names.value.length > MANY);
  watch([() => groups.value, part], () => {
    const labels = groups.value?.groups.map(({ label }) => label) ?? [];
    if (groups.value && part.value && !labels.includes(part.value)) part.value = "";
    choose({ group: part.value });
  });
  const missing = computed(() => (groups.value?.ungrouped ?? []).filter(({ robot }) => !names.value.includes(robot)));
  return { part, matrix, names, many, missing };
}

// For `setup`: the pair that is looked at, which is hovered, chosen, or the first of all, and what the matrix has of it.
export function useCell({ kind, told }, groups, { matrix, names }) {
  const chosen = ref(chosenIn("a") && chosenIn("b") ? [chosenIn("a"), chosenIn("b")] : null);
  const hovered = ref(null);
  const pair = computed(() => {
    if (hovered.value) return hovered.value;
    if (chosen.value) return chosen.value;
    const { robots, order } = matrix.value ?? { order: [] };
    return order.length > 1 ? [robots[order[0]], robots[order[1]]] : null;
  });
  // Those of the matrix, and whoever else can be asked for.
  const known = computed(() => {
    const others = (groups.value?.ungrouped ?? []).map(({ robot }) => robot);
    return [...new Set([...names.value, ...others, ...(chosen.value ?? [])])].sort(byName);
  });
  // There at once, without a question to the station.
  const value = computed(() => {
    const [a, b] = (pair.value ?? []).map((name) => told.value?.robots.indexOf(name) ?? -1);
    if (told.value?.kind !== kind.value) return null;
    if (!(a >= 0 && b >= 0)) return "not known";
    const found = told.value.values[a * told.value.robots.length + b];
    return Number.isNaN(found) ? "not known" : matrix.value.measure.text(found);
  });
  const spoken = ref("");
  const pick = (names_, aloud) => {
    chosen.value = names_;
    choose({ a: names_[0], b: names_[1] });
    if (aloud) spoken.value = `${names_[0]} and ${names_[1]}: ${MATRICES[kind.value].name} ${value.value ?? "none"}`;
  };
  const pickSide = (side, name) => {
    const [a, b] = pair.value;
    pick(side === "a" ? [name, b] : [a, name], false);
  };
  const open = () => {
    const [a, b] = pair.value ?? [];
    if (a && a !== b) location.assign(page(`/pairs/${a}/${b}`));
  };
  return { chosen, hovered, pair, known, value, spoken, pick, pickSide, open };
}
