// The score of every number of groups under two settings: a line each, the highest marked, and the same as a table.
import { computed } from "vue";
import { counted } from "covista/looks.js";
import { bestOf } from "covista/score_best.js";

const [WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [360, 150, 14, 12, 12, 24];

export default {
  props: { now: { type: Object, required: true }, then: { type: Object, default: null } },
  setup(props) {
    // Scores of different criteria have nothing to do with each other: each line has its own height then.
    const alike = computed(() => !props.then || props.now.criterion === props.then.criterion);
    const reports = computed(() => [
      { key: "now", title: props.then ? "with the settings in force" : "now", report: props.now },
      ...(props.then ? [{ key: "then", title: "with these settings", report: props.then }] : []),
    ].filter(({ report }) => report.scores.length));
    const numbers = computed(() =>
      [...new Set(reports.value.flatMap(({ report }) => report.scores.map(({ groups }) => groups)))].sort((a, b) => a - b));
    const x = (groups) => {
      const [least, most] = [numbers.value[0], numbers.value.at(-1)];
      return LEFT + ((groups - least) / Math.max(most - least, 1)) * (WIDTH - LEFT - RIGHT);
    };
    const spanOf = (some) => {
      const scores = some.flatMap(({ report }) => report.scores.map(({ score }) => score));
      return [Math.min(0, ...scores), Math.max(...scores)];
    };
    const lines = computed(() =>
      reports.value.map((each) => {
        const [low, high] = spanOf(alike.value ? reports.value : [each]);
        const y = (score) => HEIGHT - BOTTOM - ((score - low) / (high - low || 1)) * (HEIGHT - TOP - BOTTOM);
        const scores = [...each.report.scores].sort((a, b) => a.groups - b.groups);
        const top = bestOf(scores);
        return { ...each, top, at: [x(top.groups), y(top.score)], points: scores.map(({ groups, score }) => `${x(groups)},${y(score)}`).join(" ") };
      }));
    const ticks = computed(() => {
      const step = Math.max(1, Math.ceil(numbers.value.length / 12));
      return numbers.value.filter((_, k) => k % step === 0).map((groups) => ({ groups, x: x(groups) }));
    });
    const scoreOf = (report, groups) => report.scores.find((each) => each.groups === groups)?.score;
    const words = computed(() =>
      lines.value.map(({ title, top }) => `${title}: ${counted(top.groups, "group")} score${top.groups === 1 ? "s" : ""} highest, ${top.score.toFixed(2)}`).join("; "));
    return { alike, reports, numbers, lines, ticks, scoreOf, words, WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM };
  },
  template: `
    <figure v-if="numbers.length" class="cv-scores">
      <svg :viewBox="'0 0 ' + WIDTH + ' ' + HEIGHT" role="img" :aria-label="'Score of every number of groups. ' + words">
        <line :x1="LEFT" :x2="WIDTH - RIGHT" :y1="HEIGHT - BOTTOM" :y2="HEIGHT - BOTTOM" class="cv-axis"></line>
        <text v-for="tick in ticks" :key="tick.groups" :x="tick.x" :y="HEIGHT - 8" text-anchor="middle">{{ tick.groups }}</text>
        <g v-for="line in lines" :key="line.key" :class="'cv-line-' + line.key">
          <polyline :points="line.points"></polyline>
          <circle :cx="line.at[0]" :cy="line.at[1]" :r="line.key === 'now' ? 7 : 4"></circle>
        </g>
      </svg>
      <figcaption><span v-for="line in lines" :key="line.key" :class="'cv-key-' + line.key">{{ line.title }}: {{ line.top.groups }}
        {{ line.top.groups === 1 ? "group scores" : "groups score" }} highest ({{ line.top.score.toFixed(2) }}, {{ line.report.criterion }})</span>
        <span v-if="then">Scores say which number is best under its own settings, and not which settings are better.
          <template v-if="!alike">Of two criteria each has its own scale.</template></span></figcaption>
      <details><summary>As a table</summary>
        <table class="cv-table">
          <thead><tr><th scope="col" class="cv-number">Groups</th><th v-for="each in reports" :key="each.key" scope="col" class="cv-number">Score {{ each.title }}</th></tr></thead>
          <tbody><tr v-for="groups in numbers" :key="groups"><td class="cv-number">{{ groups }}</td>
            <td v-for="each in reports" :key="each.key" class="cv-number">{{ scoreOf(each.report, groups)?.toFixed(3) ?? "not looked at" }}</td></tr></tbody>
        </table></details>
    </figure>
    <p v-else>No number of groups was looked at yet.</p>`,
};
