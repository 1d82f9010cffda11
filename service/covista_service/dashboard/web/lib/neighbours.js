// With whom a robot shares its view, the most first.
import { computed } from "vue";
import { page } from "covista/ask.js";
import { ago, byName, percent, silence } from "covista/looks.js";

const HOW = { image: "found in images", predicted: "predicted", decayed: "from before", unknown: "not known" };
const MOST = 50;

export default {
  // `silent`: { name: { status, silent_s } } of those that are not live.
  props: { robot: { type: String, required: true }, pairs: { type: Array, default: null }, silent: { type: Object, default: () => ({}) } },
  setup(props) {
    const all = computed(() =>
      (props.pairs ?? [])
        .map((pair) => {
          const first = pair.a === props.robot;
          const [own, theirs] = first ? [pair.overlap_a, pair.overlap_b] : [pair.overlap_b, pair.overlap_a];
          const name = first ? pair.b : pair.a;
          return { name, silent: props.silent[name], own, theirs, how: HOW[pair.found_by], ageS: pair.age_s };
        })
        .sort((p, q) => Math.max(q.own ?? 0, q.theirs ?? 0) - Math.max(p.own ?? 0, p.theirs ?? 0) || byName(p.name, q.name)),
    );
    const shown = computed(() => all.value.slice(0, MOST));
    const predicted = computed(() => shown.value.some((each) => each.how === HOW.predicted));
    return { all, shown, predicted, silence, page, ago, percent };
  },
  template: `
    <section class="cv-card" aria-labelledby="cv-neighbours">
      <h2 id="cv-neighbours">Who shares its view</h2>
      <p v-if="pairs === null">Asking the station.</p>
      <p v-else-if="!all.length">No other robot is known to see anything that {{ robot }} sees.</p>
      <div v-else class="cv-scroll" tabindex="0" role="group" aria-label="Neighbours">
        <table class="cv-table">
          <thead><tr><th scope="col">Robot</th><th scope="col" class="cv-number">sees of {{ robot }}'s view</th>
            <th scope="col" class="cv-number">{{ robot }} sees of its view</th><th scope="col">How that is known</th></tr></thead>
          <tbody><tr v-for="each in shown" :key="each.name">
            <th scope="row"><a :href="page('/robots/' + each.name)">{{ each.name }}</a>
              <span v-if="each.silent" class="cv-silent">{{ silence(each.silent.status, each.silent.silent_s) }}</span></th>
            <td class="cv-number"><span class="cv-share" aria-hidden="true"><i :style="{ width: 100 * (each.own ?? 0) + '%' }"></i></span> {{ percent(each.own) }}</td>
            <td class="cv-number"><span class="cv-share" aria-hidden="true"><i :style="{ width: 100 * (each.theirs ?? 0) + '%' }"></i></span> {{ percent(each.theirs) }}</td>
            <td><a :href="page('/pairs/' + robot + '/' + each.name)" :aria-label="'What ' + robot + ' and ' + each.name + ' both see'">{{ each.how }}</a><template v-if="each.ageS >= 1">, {{ ago(each.ageS) }} ago</template></td>
          </tr></tbody>
        </table>
        <p v-if="predicted" class="cv-soft">Predicted: from what both have seen before, for where they look now.</p>
        <p v-if="all.length > shown.length">and {{ all.length - shown.length }} more that share less.</p>
      </div>
    </section>`,
};
