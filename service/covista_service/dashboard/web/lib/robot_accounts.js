// What became of what a robot has sent: how often it sends, and every message accounted for.
import { computed } from "vue";

const WORDS = ["received", "used", "replaced", "duplicate", "missing", "waiting"];
const MEANINGS = [
  ["received", "came here: used, replaced, duplicate, waiting or dropped"],
  ["used", "was taken up"],
  ["replaced", "was overtaken by a newer one before its turn: that is no fault"],
  ["duplicate", "had come before"],
  ["missing", "was sent and never came: the way here loses it"],
  ["waiting", "has come, and is not taken up yet"],
  ["dropped", "came and could not be used, for the reasons below"],
];
function rate(value) {
  if (value === null) return "not known yet";
  if (value < 0.05) return value ? "less than 0.1 a second" : "none now";
  return `${value < 9.95 ? value.toFixed(1) : Math.round(value)} a second`;
}

export default {
  props: {
    report: { type: Object, required: true },
    dropped: { type: Array, default: () => [] },
    // Messages a second: { keyframes, poses, missing }.
    rates: { type: Object, required: true },
  },
  setup(props) {
    const rows = computed(() =>
      [["keyframes", props.report.keyframes], ["poses", props.report.poses]].map(([name, counters]) => ({
        name,
        counters,
        dropped: Object.values(counters.dropped).reduce((sum, count) => sum + count, 0),
      })),
    );
    return { rows, rate, WORDS, MEANINGS };
  },
  template: `
    <section class="cv-card" aria-labelledby="cv-accounts">
      <h2 id="cv-accounts">What it sends</h2>
      <dl class="cv-facts">
        <dt>Keyframes</dt><dd>{{ rate(rates.keyframes) }}</dd>
        <dt>Poses</dt><dd>{{ rate(rates.poses) }}</dd>
        <dt>Missing</dt><dd :class="{ 'cv-problem': rates.missing > 0 }">{{ rate(rates.missing) }}</dd>
      </dl>
      <div class="cv-scroll" tabindex="0" role="group" aria-label="Accounts">
        <table class="cv-table">
          <thead><tr><th scope="col">Since it was first heard</th><th v-for="row in rows" :key="row.name" scope="col" class="cv-number">{{ row.name }}</th></tr></thead>
          <tbody>
            <tr v-for="word in WORDS" :key="word"><th scope="row">{{ word }}</th>
              <td v-for="row in rows" :key="row.name" class="cv-number">{{ row.counters[word].toLocaleString('en') }}</td></tr>
            <tr><th scope="row">dropped</th>
              <td v-for="row in rows" :key="row.name" class="cv-number" :class="{ 'cv-problem': row.dropped }">{{ row.dropped.toLocaleString('en') }}</td></tr>
          </tbody>
        </table>
      </div>
      <details><summary>What these words mean</summary>
        <dl class="cv-facts"><template v-for="[word, meaning] in MEANINGS" :key="word"><dt>{{ word }}</dt><dd>{{ meaning }}</dd></template></dl>
      </details>
      <template v-if="dropped.length">
        <h3>Dropped, and why</h3>
        <ul class="cv-list"><li v-for="each in dropped" :key="each.of + each.reason">
          <span><b>{{ each.count.toLocaleString('en') }} {{ each.of }}: {{ each.reason }}.</b> {{ each.meaning }}</span></li></ul>
      </template>
      <p v-if="report.last_problem">Last problem: {{ report.last_problem }}</p>
    </section>`,
};
