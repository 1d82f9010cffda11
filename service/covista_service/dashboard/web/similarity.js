// The matrix of all robots ordered by group, one pair of it in words, and why there are so many groups.
import { computed, ref, shallowRef, watch } from "vue";
import { page, rest, tagged } from "covista/ask.js";
import { choose, chosenIn } from "covista/address.js";
import { MATRICES, measureOf } from "covista/colour_scale.js";
import { byName, REASONS } from "covista/looks.js";
import { orderOf } from "covista/matrix_order.js";
import { matrixOf } from "covista/npy.js";
import { usePairFacts } from "covista/pair_facts.js";
import { pulse } from "covista/pulse.js";
import GroupMark from "covista/group_mark.js";
import GroupNumber from "covista/group_number.js";
import MatrixTable from "covista/matrix_table.js";
import PairBrief from "covista/pair_brief.js";
import ScaleLegend from "covista/scale_legend.js";
import SimilarityMatrix from "covista/similarity_matrix.js";

// How long until a matrix of so many robots is asked for again: one of a thousand has 8 MB.
const PAUSES_MS = [[60, 1000], [200, 2000], [500, 5000], [Infinity, 10000]];
const LONG_MS = 60000;
const GROUPS_MS = 1000;
// Of more robots than these one may want to see a part.
const MANY = 40;
const FEW_MISSING = 12;

export default {
  components: { GroupMark, GroupNumber, MatrixTable, PairBrief, ScaleLegend, SimilarityMatrix },
  setup() {
    const kind = ref(chosenIn("matrix") in MATRICES ? chosenIn("matrix") : "similarity");
    const part = ref(chosenIn("group") ?? "");
    const groups = shallowRef(null);
    const told = shallowRef(null);
    const problem = ref("");
    const chosen = ref(chosenIn("a") && chosenIn("b") ? [chosenIn("a"), chosenIn("b")] : null);
    const hovered = ref(null);

    pulse(tagged(rest("/groups"), (found) => (groups.value = found)), GROUPS_MS);
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
    // Those of the matrix, and whoever else can be asked for.
    const known = computed(() => {
      const others = (groups.value?.ungrouped ?? []).map(({ robot }) => robot);
      return [...new Set([...names.value, ...others, ...(chosen.value ?? [])])].sort(byName);
    });
    const many = computed(() => names.value.length > MANY);
    watch([() => groups.value, part], () => {
      const labels = groups.value?.groups.map(({ label }) => label) ?? [];
      if (groups.value && part.value && !labels.includes(part.value)) part.value = "";
      choose({ group: part.value });
    });
    const missing = computed(() => (groups.value?.ungrouped ?? []).filter(({ robot }) => !names.value.includes(robot)));

    const pair = computed(() => {
      if (hovered.value) return hovered.value;
      if (chosen.value) return chosen.value;
      const { robots, order } = matrix.value ?? { order: [] };
      return order.length > 1 ? [robots[order[0]], robots[order[1]]] : null;
    });
    const { facts, problem: unpaired } = usePairFacts(pair);
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
    // What the matrix itself has of the pair: there at once.
    const value = computed(() => {
      const [a, b] = (pair.value ?? []).map((name) => told.value?.robots.indexOf(name) ?? -1);
      if (told.value?.kind !== kind.value) return null;
      if (!(a >= 0 && b >= 0)) return "not known";
      const found = told.value.values[a * told.value.robots.length + b];
      return Number.isNaN(found) ? "not known" : matrix.value.measure.text(found);
    });
    const open = () => {
      const [a, b] = pair.value ?? [];
      if (a && a !== b) location.assign(page(`/pairs/${a}/${b}`));
    };
    return {
      kind, part, groups, matrix, known, many, missing, problem, pair, facts, unpaired, value, spoken, chosen, hovered,
      pick, pickSide, open, page, MATRICES, REASONS, FEW_MISSING,
    };
  },
  template: `
    <div class="cv-similarity">
      <section class="cv-card" aria-labelledby="cv-shown">
        <h2 id="cv-shown" class="cv-hidden">Matrix</h2>
        <fieldset class="cv-switch"><legend class="cv-hidden">What is shown</legend>
          <label v-for="(each, name) in MATRICES" :key="name"><input type="radio" name="matrix" :value="name" v-model="kind"><span>{{ each.name }}</span></label>
        </fieldset>
        <label v-if="many" class="cv-part">Show <select v-model="part"><option value="">all groups</option>
          <option v-for="group in groups?.groups ?? []" :key="group.label" :value="group.label">{{ group.label }} ({{ group.robots.length }})</option></select></label>
        <p class="cv-soft">{{ MATRICES[kind].title }}.</p>
        <p v-if="problem" class="cv-problem" role="alert">{{ problem }}</p>
        <p v-if="!matrix && !problem">Asking the station.</p>
        <p v-else-if="matrix && !matrix.order.length">{{ missing.length ? 'No robot is here that has told a pose' : 'No robot has been heard yet' }}, so there is nothing to compare.</p>
        <div v-show="matrix?.order.length">
          <scale-legend v-if="matrix" :measure="matrix.measure" :key="kind + matrix.measure.top"></scale-legend>
          <similarity-matrix :matrix="matrix" :chosen="pair" @hover="hovered = $event" @choose="pick" @open="open"></similarity-matrix>
          <matrix-table v-if="matrix" :matrix="matrix" :kind="MATRICES[kind].name" :robot="pair?.[0]"></matrix-table>
        </div>
        <p v-if="missing.length" class="cv-missing"><strong>Not in it:</strong>{{ ' ' }}<span v-for="each in missing.slice(0, FEW_MISSING)" :key="each.robot"><a :href="page('/robots/' + each.robot)">{{ each.robot }}</a> {{ REASONS[each.reason] }}; </span>
          <span v-if="missing.length > FEW_MISSING">and {{ missing.length - FEW_MISSING }} more</span></p>
        <p class="cv-hidden" aria-live="polite">{{ spoken }}</p>
      </section>
      <aside class="cv-panel">
        <section v-if="pair" aria-labelledby="cv-pair">
          <h2 id="cv-pair">{{ pair[0] }} and {{ pair[1] }}: <span class="cv-value">{{ MATRICES[kind].name }} {{ value ?? '...' }}</span></h2>
          <p class="cv-pick">
            <label>Row <select :value="pair[0]" @change="pickSide('a', $event.target.value)">
              <option v-for="name in known" :key="name">{{ name }}</option></select></label>
            <label>Column <select :value="pair[1]" @change="pickSide('b', $event.target.value)">
              <option v-for="name in known" :key="name">{{ name }}</option></select></label>
          </p>
          <p v-if="pair[0] === pair[1]">A robot with itself: it sees all that it sees.</p>
          <p v-else-if="unpaired" class="cv-problem">The station says: {{ unpaired }}.</p>
          <template v-else>
            <pair-brief v-if="facts" :facts="facts"></pair-brief>
            <p v-else class="cv-brief">Asking the station.</p>
            <p><a :href="page('/pairs/' + pair[0] + '/' + pair[1])">What both see, with pictures</a></p>
          </template>
        </section>
        <group-number :groups="groups"></group-number>
      </aside>
    </div>`,
};
