// Why this number of groups: the criterion in words, the score of every number, and what stands in the way.
import { computed } from "vue";
import { criterionSentence, scoreSentence } from "covista/criteria.js";
import { bestOf } from "covista/score_best.js";
import { counted } from "covista/looks.js";
import ScoreChart from "covista/score_chart.js";

const FEW_NAMES = 12;
const listed = (names) =>
  names.length > FEW_NAMES ? `${names.slice(0, FEW_NAMES).join(", ")} and ${names.length - FEW_NAMES} more` : names.join(", ");
const groupsOf = (count) => counted(count, "group");

// What holds of the number that is shown, in sentences.
function reasonsOf(groups) {
  const { scores, settings, waiting } = groups;
  const [shown, best] = [groups.groups.length, bestOf(scores)?.groups ?? null];
  const sentences = [];
  const asked = settings.groups;
  if (typeof asked === "number") sentences.push(`The settings ask for ${groupsOf(asked)}; no other number is looked at.`);
  else if (asked !== "auto") sentences.push(`The settings ask for ${asked.min} to ${asked.max} groups.`);
  if (settings.min_group_size > 1) sentences.push(`A group has ${settings.min_group_size} robots at least.`);
  if (best !== null && best === shown) sentences.push(`${groupsOf(shown)} ${shown === 1 ? "has" : "have"} the best score.`);
  if (best !== null && best !== shown) sentences.push(`${groupsOf(best)} would score best now, and ${shown} ${shown === 1 ? "is" : "are"} shown.`);
  if (waiting.length) {
    const lasting = settings.hysteresis.persistence_s;
    sentences.push(`Another grouping is proposed for ${listed(waiting)}; it is shown if that lasts ${lasting} s.`);
  } else if (best !== null && best !== shown) sentences.push("Groups on show are held on to until another grouping is better for long enough.");
  return sentences;
}

export default {
  components: { ScoreChart },
  props: { groups: { type: Object, default: null } },
  setup(props) {
    const sentences = computed(() => (props.groups ? reasonsOf(props.groups) : []));
    const heading = computed(() => (props.groups?.groups.length ? `Why ${groupsOf(props.groups.groups.length)}?` : "Why this number of groups?"));
    const made = computed(() => (props.groups?.settings.grouping === "distance" ? "Groups are made by distance alone." : ""));
    return { sentences, heading, made, criterionSentence, scoreSentence };
  },
  template: `
    <section aria-labelledby="cv-number">
      <h2 id="cv-number">{{ heading }}</h2>
      <p v-if="!groups">Asking the station.</p>
      <p v-else-if="!groups.scores.length">There are no groups: no robot is here that has told a pose.</p>
      <template v-else>
        <p v-for="sentence in sentences" :key="sentence">{{ sentence }}</p>
        <p v-if="groups.note" class="cv-note"><strong>Note:</strong> {{ groups.note }}.</p>
        <score-chart :scores="groups.scores" :chosen="groups.groups.length"></score-chart>
        <p><strong>{{ groups.criterion }}</strong>: {{ criterionSentence(groups.criterion) }} {{ made }} {{ scoreSentence(groups.criterion) }}</p>
        <details class="cv-details">
          <summary>All scores as a table</summary>
          <div class="cv-scroll cv-low"><table class="cv-table">
            <thead><tr><th scope="col" class="cv-number">Groups</th><th scope="col" class="cv-number">Score</th></tr></thead>
            <tbody><tr v-for="each in groups.scores" :key="each.groups">
              <th scope="row" class="cv-number">{{ each.groups }}</th><td class="cv-number">{{ each.score.toFixed(3) }}</td></tr></tbody>
          </table></div>
        </details>
      </template>
    </section>`,
};
