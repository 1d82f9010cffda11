// What is known of two robots, in short: what both see, how near and alike they are, how that was found.
import { computed } from "vue";
import { metres } from "covista/colour_scale.js";
import { ago, percent } from "covista/looks.js";
import { page } from "covista/ask.js";
import GroupMark from "covista/group_mark.js";

const between = (interval) => (interval ? `${Math.round(100 * interval[0])} to ${percent(interval[1])}` : "");
const number = (value) => (value === null || value === undefined ? "not known" : value.toFixed(2));

export default {
  components: { GroupMark },
  props: { facts: { type: Object, required: true } },
  setup(props) {
    const sides = computed(() => {
      const { a, b, overlap_a, overlap_b, interval_a, interval_b } = props.facts;
      return [
        { seer: b, seen: a, share: overlap_a, interval: between(interval_a), side: "a" },
        { seer: a, seen: b, share: overlap_b, interval: between(interval_b), side: "b" },
      ];
    });
    return { sides, number, metres, ago, percent, page };
  },
  template: `
    <div class="cv-brief">
      <p v-for="warning in facts.warnings" :key="warning" class="cv-warning">{{ warning }}</p>
      <ul class="cv-list cv-shares">
        <li v-for="{ seer, seen, share, interval, side } in sides" :key="side">
          <span class="cv-bar" aria-hidden="true"><svg viewBox="0 0 100 10" preserveAspectRatio="none" width="72" height="12">
            <rect class="cv-bar-all" width="100" height="10"></rect>
            <rect v-if="share !== null" :class="'cv-bar-' + side" :width="100 * share" height="10"></rect></svg></span>
          <span><strong>{{ percent(share) }}</strong> of {{ seen }}'s view is seen by {{ seer }}{{ ' ' }}<span v-if="interval" class="cv-soft">(90 % sure: {{ interval }})</span></span>
        </li>
      </ul>
      <dl class="cv-facts">
        <dt>Found</dt><dd>{{ facts.how }} {{ facts.why_not ?? facts.matched }}</dd>
        <dt>Age</dt><dd>{{ facts.age_s === null ? 'nothing found yet' : ago(facts.age_s) }}</dd>
        <dt>Similarity</dt><dd>{{ number(facts.similarity) }} <span class="cv-soft">closeness {{ number(facts.closeness) }}</span></dd>
        <dt>Distance</dt><dd>{{ facts.distance_m === null ? 'not known: one of them is gone, or has told no pose' : metres(facts.distance_m) }}</dd>
        <dt>Groups</dt><dd class="cv-members"><span v-for="robot in facts.robots" :key="robot.id">
          <a :href="page('/robots/' + robot.id)">{{ robot.id }}</a> <group-mark :label="robot.group"></group-mark></span></dd>
      </dl>
    </div>`,
};
