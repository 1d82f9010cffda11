// The matrix of all robots ordered by group, one pair of it in words, and why there are so many groups.
import { page } from "covista/ask.js";
import { MATRICES } from "covista/colour_scale.js";
import { REASONS } from "covista/looks.js";
import { useGroups, useMatrix } from "covista/matrix_asking.js";
import { useCell, useShown } from "covista/matrix_shown.js";
import { usePairFacts } from "covista/pair_facts.js";
import GroupNumber from "covista/group_number.js";
import MatrixTable from "covista/matrix_table.js";
import PairBrief from "covista/pair_brief.js";
import ScaleLegend from "covista/scale_legend.js";
import SimilarityMatrix from "covista/similarity_matrix.js";

const FEW_MISSING = 12;

export default {
  components: { GroupNumber, MatrixTable, PairBrief, ScaleLegend, SimilarityMatrix },
  setup() {
    const groups = useGroups();
    const asking = useMatrix();
    const shown = useShown(asking.told, groups);
    const cell = useCell(asking, groups, shown);
    const { facts, problem: unpaired } = usePairFacts(cell.pair);
    return { groups, ...asking, ...shown, ...cell, facts, unpaired, page, MATRICES, REASONS, FEW_MISSING };
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
