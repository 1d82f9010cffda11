// Two robots: both keyframes with the common field, what is known of it, the planes behind it, and how it was before.
import { computed, ref } from "vue";
import { page } from "covista/ask.js";
import { ago, silence } from "covista/looks.js";
import { isId, usePairFacts } from "covista/pair_facts.js";
import { usePairLook } from "covista/pair_look.js";
import { usePartners } from "covista/pair_partners.js";
import GroupMark from "covista/group_mark.js";
import PairBrief from "covista/pair_brief.js";
import PairHistory from "covista/pair_history.js";
import PairPicture from "covista/pair_picture.js";
import PlanesTable from "covista/planes_table.js";

// What is wrong with the address itself.
function wrongIn(a, b) {
  const odd = [a, b].find((name) => !isId(name));
  if (odd !== undefined) return `No robot can be called ${odd}: names are of small letters, digits, - and _.`;
  return a === b ? `${a} makes no pair with itself. Choose another robot.` : "";
}

// Which moment the pictures are of.
function momentOf(look, sinceS, wanted) {
  if (!look || sinceS === null) return "";
  if (wanted === "held") return "Held: what has come since is not in the pictures.";
  if (!look.explained) return "Of the newest keyframes, without planes.";
  return sinceS < 2 ? "Of the newest keyframes, with planes." : `Of ${ago(sinceS)} ago: newer keyframes have no planes yet.`;
}

// Why there are no planes.
function whyNone(look, facts) {
  if (!look) return "Asking the station.";
  if (!look.pair.keyframes) return "None: what both see is not known yet.";
  const why = facts?.why_not;
  if (why) return `None. ${why}`;
  if (facts?.inliers) return "None in these keyframes: they were not compared with one another.";
  return "None in these keyframes: nothing was matched in both.";
}

export default {
  components: { GroupMark, PairBrief, PairHistory, PairPicture, PlanesTable },
  props: { a: String, b: String },
  setup(props) {
    document.title = `${props.a} and ${props.b} - Covista`;
    const pair = computed(() => [props.a, props.b]);
    const wrong = computed(() => wrongIn(props.a, props.b));
    const { facts, problem, aheadMs } = usePairFacts(pair);
    const wanted = ref("told");
    const { look, sinceS } = usePairLook(pair, wanted, computed(() => facts.value !== null));
    const moment = computed(() => momentOf(look.value, sinceS.value, wanted.value));
    const none = computed(() => whyNone(look.value, facts.value));
    const sides = computed(() =>
      ["a", "b"].map((side, k) => {
        const [name, other] = k ? [props.b, props.a] : [props.a, props.b];
        const keyframe = look.value?.pair.keyframes?.[side];
        return { side, name, other, keyframe, robot: facts.value?.robots[k], picture: look.value?.pictures[k] };
      }),
    );
    return { ...usePartners(props.a, props.b), facts, problem, aheadMs, wrong, wanted, look, moment, none, sides, page, silence };
  },
  template: `
    <div class="cv-pair">
      <nav class="cv-pick cv-card" aria-label="Pairs">
        <label>What <select :value="a" @change="go($event.target.value, b === $event.target.value ? a : b)">
          <option v-for="name in options(a)" :key="name">{{ name }}</option></select></label>
        <label>and <select :value="b" @change="go(a === $event.target.value ? b : a, $event.target.value)">
          <option v-for="name in options(b)" :key="name">{{ name }}</option></select> both see</label>
        <a :href="page('/pairs/' + b + '/' + a)">swap</a>
        <span class="cv-turn"><a v-if="before" rel="prev" :href="page('/pairs/' + a + '/' + before)">← {{ a }} and {{ before }}</a>
        <a v-if="after" rel="next" :href="page('/pairs/' + a + '/' + after)">{{ a }} and {{ after }} →</a></span>
      </nav>
      <p v-if="wrong" class="cv-problem" role="alert">{{ wrong }}</p>
      <template v-else>
        <p v-if="problem" class="cv-problem" role="alert">The station says: {{ problem }}. It has not been heard yet, or has been forgotten. <a :href="page('/')">To the robots that are known</a></p>
        <div class="cv-pictures" v-if="!problem">
          <pair-picture v-for="each in sides" :key="each.side" :picture="each.picture" :kind="each.robot?.picture"
            :words="'The keyframe of ' + each.name + '; what ' + each.other + ' sees of it is bright, the rest dimmed'">
            <strong><a :href="page('/robots/' + each.name)">{{ each.name }}</a></strong>
            <group-mark v-if="each.robot" :label="each.robot.group"></group-mark>
            <span v-if="each.robot && each.robot.status !== 'live'" class="cv-alarm">{{ silence(each.robot.status, each.robot.silent_s) }}</span>
            <span v-if="each.keyframe" class="cv-soft">keyframe {{ each.keyframe.sequence }} <span :title="'boot ' + each.keyframe.boot">of boot {{ each.keyframe.boot.slice(0, 8) }}</span></span>
          </pair-picture>
        </div>
        <div v-if="look && !problem" class="cv-headed">
          <p class="cv-legend">
            <span>bright: seen by both</span><span>dimmed: by this robot alone</span>
            <span><svg class="cv-swatch" viewBox="0 0 16 16" width="14" height="14" aria-hidden="true"><circle class="cv-point" cx="8" cy="8" r="6"></circle></svg> matched point on a plane</span>
            <span><svg class="cv-swatch" viewBox="0 0 16 16" width="14" height="14" aria-hidden="true"><circle class="cv-point-off" cx="8" cy="8" r="6"></circle></svg> on none</span>
            <span>tinted: planes, coloured as in the table</span>
          </p>
          <p class="cv-pick"><span class="cv-soft">{{ moment }}</span> <label>Pictures <select v-model="wanted">
            <option value="told">with planes, if lately</option><option value="newest">the newest</option><option value="held">hold these</option></select></label></p>
        </div>
        <div class="cv-known" v-if="!problem">
          <section class="cv-card" aria-labelledby="cv-facts">
            <h2 id="cv-facts">What is known</h2>
            <p class="cv-soft">Of where the robots stand now. Shares written in the pictures are of when those were taken.</p>
            <pair-brief v-if="facts" :facts="facts"></pair-brief>
            <p v-else class="cv-brief">Asking the station.</p>
          </section>
          <section class="cv-card" aria-labelledby="cv-planes">
            <h2 id="cv-planes">Planes that both see</h2>
            <planes-table v-if="look?.pair.planes.length" :planes="look.pair.planes"></planes-table>
            <p v-else>{{ none }}</p>
            <p v-if="look?.pair.planes.length" class="cv-soft">In the world: normal · X + offset = 0. Points are the matched ones that lie on it.</p>
          </section>
        </div>
        <pair-history :a="a" :b="b" :ahead-ms="aheadMs"></pair-history>
      </template>
    </div>`,
};
