// The score of every number of groups, with the one that is shown and the one that is proposed.
import { computed, onMounted, onUnmounted, ref } from "vue";
import { bestOf } from "covista/score_best.js";

const HEIGHT = 190;
const [LEFT, RIGHT, TOP, BOTTOM] = [40, 12, 24, 34];
const FEW = 16;
const TOLD = 12;

// Round values that cover a span, at most six of them.
function ticksOf(low, high) {
  const span = high - low || 1;
  const power = 10 ** Math.floor(Math.log10(span / 4));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => span / each <= 5);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(6)));
  return ticks;
}

export default {
  props: { scores: { type: Array, required: true }, chosen: { type: Number, default: null } },
  setup(props) {
    const room = ref(null);
    const width = ref(320);
    const observer = new ResizeObserver(() => (width.value = Math.max(200, room.value.clientWidth)));
    onMounted(() => observer.observe(room.value));
    onUnmounted(() => observer.disconnect());
    const chart = computed(() => {
      const numbers = props.scores.map((each) => each.groups);
      const values = props.scores.map((each) => each.score);
      const [first, last] = [Math.min(...numbers), Math.max(...numbers)];
      const [low, high] = [Math.min(0, ...values), Math.max(0, ...values)];
      const pad = 0.06 * (high - low || 1);
      const [bottom, top] = [low < 0 ? low - pad : low, high + pad];
      const x = (groups) => LEFT + ((groups - first + 0.5) / (last - first + 1)) * (width.value - LEFT - RIGHT);
      const y = (score) => TOP + ((top - score) / (top - bottom)) * (HEIGHT - TOP - BOTTOM);
      const best = bestOf(props.scores)?.groups;
      const dots = props.scores.map(({ groups, score }) => ({
        groups, x: x(groups), y: y(score), zero: y(0), shown: groups === props.chosen, best: groups === best,
        words: `${groups}: ${score.toFixed(3)}`,
      }));
      const few = dots.length <= FEW && last - first < FEW;
      // Of many numbers a line tells enough, and what matters lies on top.
      const weight = (dot) => dot.shown + dot.best;
      const marked = dots.filter((dot) => few || weight(dot)).sort((p, q) => weight(p) - weight(q));
      return {
        dots: marked, few, ticks: ticksOf(bottom, top).map((value) => ({ value, y: y(value) })), zero: y(0),
        path: few ? "" : "M" + dots.map((dot) => `${dot.x.toFixed(1)} ${dot.y.toFixed(1)}`).join("L"),
        numbers: few ? numbers.map((value) => ({ value, x: x(value) })) : ticksOf(first, last).filter((value) => value >= first && Number.isInteger(value)).map((value) => ({ value, x: x(value) })),
        mark: marked.find((dot) => dot.shown),
      };
    });
    const words = computed(() => {
      const told = [...props.scores].sort((a, b) => b.score - a.score).slice(0, TOLD).sort((a, b) => a.groups - b.groups);
      const all = told.length === props.scores.length ? "Scores by number of groups" : `The ${TOLD} best scores by number of groups`;
      return `${all}: ${told.map((each) => `${each.groups}: ${each.score.toFixed(2)}`).join(", ")}. Shown: ${props.chosen ?? "none"}; best: ${bestOf(props.scores)?.groups ?? "none"}.`;
    });
    return { room, width, chart, words, HEIGHT, LEFT, RIGHT, BOTTOM };
  },
  template: `
    <div ref="room" class="cv-chart">
      <svg role="img" :aria-label="words" :viewBox="'0 0 ' + width + ' ' + HEIGHT" :width="width" :height="HEIGHT">
        <g v-for="tick in chart.ticks" :key="tick.value">
          <line class="cv-gridline" :x1="LEFT" :x2="width - RIGHT" :y1="tick.y" :y2="tick.y"></line>
          <text class="cv-axis" :x="LEFT - 6" :y="tick.y + 4" text-anchor="end">{{ tick.value }}</text>
        </g>
        <line class="cv-zero" :x1="LEFT" :x2="width - RIGHT" :y1="chart.zero" :y2="chart.zero"></line>
        <path v-if="chart.path" class="cv-trail" :d="chart.path"></path>
        <g v-for="dot in chart.dots" :key="dot.groups">
          <title>{{ dot.words }}</title>
          <line v-if="chart.few" class="cv-stem" :class="{ 'cv-shown': dot.shown }" :x1="dot.x" :x2="dot.x" :y1="dot.zero" :y2="dot.y"></line>
          <circle class="cv-dot" :class="{ 'cv-shown': dot.shown, 'cv-best': dot.best }" :cx="dot.x" :cy="dot.y"
            :r="dot.shown || dot.best ? 6 : 4"></circle>
        </g>
        <text v-if="chart.mark" class="cv-label" :x="Math.min(width - 46, Math.max(LEFT + 24, chart.mark.x))" :y="Math.max(14, chart.mark.y - 11)"
          text-anchor="middle">{{ chart.mark.groups }} shown</text>
        <text v-for="number in chart.numbers" :key="'n' + number.value" class="cv-axis" :x="number.x" :y="HEIGHT - BOTTOM + 15"
          text-anchor="middle">{{ number.value }}</text>
        <text class="cv-axis" :x="(LEFT + width - RIGHT) / 2" :y="HEIGHT - 3" text-anchor="middle">number of groups</text>
      </svg>
    </div>`,
};
