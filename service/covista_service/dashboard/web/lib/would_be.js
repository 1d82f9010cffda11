// Groups that stand beside those that other settings would make: a row a group, and who would move is marked.
import { computed } from "vue";
import { page } from "covista/ask.js";
import { byLabel, byName } from "covista/looks.js";
import GroupMark from "covista/group_mark.js";

// Of a group so many robots are shown at once; who would move always is.
const SHOWN = 24;

const labelsOf = (report) =>
  new Map((report?.groups ?? []).flatMap(({ label, robots }) => robots.map((robot) => [robot, label])));

// Who stands elsewhere in another answer: robot, from, to; null is no group.
export function movers(now, then) {
  const [before, after] = [labelsOf(now), labelsOf(then)];
  return [...new Set([...before.keys(), ...after.keys()])]
    .map((robot) => ({ robot, from: before.get(robot) ?? null, to: after.get(robot) ?? null }))
    .filter(({ from, to }) => from !== to)
    .sort((a, b) => byName(a.robot, b.robot));
}

const Members = {
  props: { robots: { type: Array, required: true }, moved: { type: Map, required: true }, side: { type: String, required: true } },
  setup(props) {
    const shown = computed(() => {
      const first = props.robots.filter((robot) => props.moved.has(robot));
      return [...first, ...props.robots.filter((robot) => !props.moved.has(robot))];
    });
    const where = (robot) => {
      const { from, to } = props.moved.get(robot);
      return props.side === "now" ? `to ${to ?? "no group"}` : `from ${from ?? "no group"}`;
    };
    return { shown, where, page, SHOWN };
  },
  template: `
    <ul class="cv-inline">
      <li v-if="shown.length > SHOWN"><b>{{ shown.length }} robots:</b></li>
      <li v-for="robot in shown.slice(0, SHOWN)" :key="robot">
        <a :href="page('/robots/' + robot)" :class="{ 'cv-mover': moved.has(robot) }">{{ robot }}</a><small v-if="moved.has(robot)"> {{ where(robot) }}</small>
      </li>
      <li v-if="shown.length > SHOWN"><details><summary>and {{ shown.length - SHOWN }} more</summary>
        <span v-for="robot in shown.slice(SHOWN)" :key="robot"><a :href="page('/robots/' + robot)">{{ robot }}</a> </span></details></li>
    </ul>`,
};

export default {
  components: { GroupMark, Members },
  props: { now: { type: Object, required: true }, then: { type: Object, default: null } },
  setup(props) {
    const moved = computed(() => new Map((props.then ? movers(props.now, props.then) : []).map((each) => [each.robot, each])));
    const rows = computed(() => {
      const of = (report, label) => (report?.groups.find((group) => group.label === label)?.robots ?? []).toSorted(byName);
      const labels = [...new Set([props.now, props.then].flatMap((report) => (report?.groups ?? []).map(({ label }) => label)))];
      return labels.sort(byLabel).map((label) => ({ label, now: of(props.now, label), then: of(props.then, label) }));
    });
    const alone = computed(() => props.now.ungrouped.map(({ robot }) => robot).sort(byName));
    return { moved, rows, alone };
  },
  template: `
    <div class="cv-scroll"><table class="cv-table cv-beside">
      <thead><tr><th scope="col">Group</th><th scope="col">Now</th><th v-if="then" scope="col">With these settings</th></tr></thead>
      <tbody>
        <tr v-for="row in rows" :key="row.label">
          <th scope="row"><group-mark :label="row.label"></group-mark>
            <small v-if="then && !row.now.length">new</small><small v-if="then && !row.then.length">ends</small></th>
          <td data-side="now"><members :robots="row.now" :moved="moved" side="now"></members></td>
          <td v-if="then" data-side="then"><members :robots="row.then" :moved="moved" side="then"></members></td>
        </tr>
        <tr v-if="alone.length"><th scope="row">in none</th><td :colspan="then ? 2 : 1">{{ alone.join(", ") }}</td></tr>
      </tbody>
    </table></div>`,
};
