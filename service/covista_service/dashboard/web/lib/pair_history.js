// The history of a pair's overlap, as a chart and in words.
import { computed, ref, toRef } from "vue";
import { choose, chosenIn } from "covista/address.js";
import { percent } from "covista/looks.js";
import { clock } from "covista/moments.js";
import { usePairPast } from "covista/pair_past.js";
import LineChart from "covista/line_chart.js";

const SPANS = [[2, "2 min"], [10, "10 min"], [60, "1 h"]];
const FOUND = { image: "found in images", predicted: "predicted", decayed: "old", unknown: "not known" };
const ROWS = 50;

export default {
  components: { LineChart },
  // `aheadMs`: how far the station's clock is ahead of this one.
  props: { a: String, b: String, aheadMs: { type: Number, default: null } },
  setup(props) {
    const wanted = Number(chosenIn("minutes"));
    const minutes = ref(SPANS.some(([span]) => span === wanted) ? wanted : 10);
    const { past, problem } = usePairPast(computed(() => [props.a, props.b]), minutes, toRef(props, "aheadMs"));
    const names = computed(() => ({ a: `how much of ${props.a}'s view ${props.b} sees`, b: `how much of ${props.b}'s view ${props.a} sees` }));
    const open = ref(false);
    const rows = computed(() => (open.value && past.value ? past.value.moments.slice(-ROWS).reverse() : []));
    const span = (value) => {
      minutes.value = value;
      choose({ minutes: value });
    };
    return { minutes, past, problem, names, open, rows, span, clock, percent, SPANS, FOUND };
  },
  template: `
    <section class="cv-card" aria-labelledby="cv-past">
      <div class="cv-headed"><h2 id="cv-past">Overlap over time</h2>
        <label>Last <select :value="minutes" @change="span(Number($event.target.value))">
          <option v-for="[value, words] in SPANS" :key="value" :value="value">{{ words }}</option></select></label></div>
      <p v-if="problem" class="cv-problem" role="alert">The past cannot be shown now: {{ problem.message }}. Trying again.</p>
      <p v-if="!past && !problem">Asking the station.</p>
      <p v-else-if="past && !past.moments.length">Nothing is kept of these two in this time.</p>
      <template v-else-if="past">
        <p class="cv-legend">
          <span><svg viewBox="0 0 22 8" width="22" height="8" aria-hidden="true"><path class="cv-line-a" d="M0 4H22"></path></svg> {{ names.a }}</span>
          <span><svg viewBox="0 0 22 8" width="22" height="8" aria-hidden="true"><path class="cv-line-b" d="M0 4H22"></path></svg> {{ names.b }}</span>
        </p>
        <line-chart :moments="past.moments" :names="names" :from="past.from" :to="past.to" :gaps="past.gaps" v-slot="{ at }">
          <p class="cv-moment" aria-live="polite"><template v-if="at && at.moment"><strong>{{ clock(at.ms) }}</strong>:
            {{ b }} sees {{ percent(at.moment.a) }} of {{ a }}'s view, {{ a }} sees {{ percent(at.moment.b) }} of {{ b }}'s ({{ FOUND[at.moment.foundBy] }})</template>
            <template v-else-if="at"><strong>{{ clock(at.ms) }}</strong>: nothing was kept yet</template>
            <span v-else class="cv-soft">Point at the chart for the values of a moment.</span></p>
        </line-chart>
        <p class="cv-legend"><span v-for="(words, name) in FOUND" :key="name"><svg viewBox="0 0 22 10" width="22" height="10" aria-hidden="true">
          <rect :class="'cv-found-' + name" width="22" height="10"></rect></svg> {{ words }}</span>
          <span v-if="past.gaps.length"><svg viewBox="0 0 22 10" width="22" height="10" aria-hidden="true"><rect class="cv-gap" width="22" height="10"></rect></svg> entries are missing</span></p>
        <p v-for="gap in past.gaps" :key="gap.from" class="cv-note">{{ clock(gap.from) }} to {{ clock(gap.to) }}: {{ gap.words }}.</p>
        <details class="cv-details" @toggle="open = $event.target.open"><summary>The newest as a table</summary>
          <div v-if="open" class="cv-scroll cv-low" tabindex="0" role="region" aria-label="Overlaps as a table"><table class="cv-table">
            <thead><tr><th scope="col">From</th><th scope="col" class="cv-number">of {{ a }}'s view</th><th scope="col" class="cv-number">of {{ b }}'s view</th><th scope="col">How</th></tr></thead>
            <tbody><tr v-for="each in rows" :key="each.key"><th scope="row">{{ clock(each.ms) }}</th><td class="cv-number">{{ percent(each.a) }}</td>
              <td class="cv-number">{{ percent(each.b) }}</td><td>{{ FOUND[each.foundBy] }}</td></tr></tbody></table></div></details>
      </template>
    </section>`,
};
