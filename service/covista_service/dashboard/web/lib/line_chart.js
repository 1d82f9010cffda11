// Shares over time as steps, with a strip below that says how they were found; a cursor tells the values of a moment.
import { computed, onMounted, onUnmounted, ref } from "vue";
import { marks } from "covista/moments.js";

const HEIGHT = 240;
const [LEFT, RIGHT, TOP, BOTTOM] = [44, 14, 10, 56];
const STRIP = 12;
const TICK_PX = 90;

// The place of the last moment that is not after `ms`; -1 before the first.
function placeAt(moments, ms) {
  let [low, high] = [0, moments.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (moments[middle].ms <= ms) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

// Lines that hold their value until the next moment; none where it is unknown.
function stepsOf(moments, name, x, y, end) {
  let path = "";
  let before = null;
  moments.forEach((moment, k) => {
    const value = moment[name];
    const until = x(k + 1 < moments.length ? moments[k + 1].ms : end).toFixed(1);
    if (value !== null) path += `${before === null ? "M" : "L"}${x(moment.ms).toFixed(1)} ${y(value).toFixed(1)}H${until}`;
    before = value;
  });
  return path;
}

// Stretches of one way of finding.
function stretchesOf(moments, x, end) {
  const stretches = [];
  moments.forEach(({ ms, foundBy }, k) => {
    if (k && moments[k - 1].foundBy === foundBy) return;
    stretches.push({ foundBy, from: x(ms) });
  });
  return stretches.map((each, k) => ({ ...each, width: Math.max(0.5, (stretches[k + 1]?.from ?? x(end)) - each.from) }));
}

export default {
  // `moments`: [{ ms, a, b, foundBy }], the oldest first; `names` of a and b; `gaps`: [{ from, to, words }].
  props: { moments: { type: Array, required: true }, names: { type: Object, required: true }, from: Number, to: Number, gaps: { type: Array, default: () => [] } },
  setup(props) {
    const room = ref(null);
    const width = ref(600);
    const cursor = ref(null);
    const observer = new ResizeObserver(() => (width.value = Math.max(240, room.value.clientWidth)));
    onMounted(() => observer.observe(room.value));
    onUnmounted(() => observer.disconnect());
    const x = (ms) => LEFT + ((Math.max(ms, props.from) - props.from) / (props.to - props.from)) * (width.value - LEFT - RIGHT);
    const y = (share) => TOP + (1 - share) * (HEIGHT - TOP - BOTTOM);
    const chart = computed(() => {
      const { moments, from, to } = props;
      const most = Math.max(2, (width.value - LEFT - RIGHT) / TICK_PX);
      return {
        a: stepsOf(moments, "a", x, y, to), b: stepsOf(moments, "b", x, y, to), stretches: stretchesOf(moments, x, to),
        ticks: marks(from, to, most).map(({ ms, words }) => ({ ms, x: x(ms), words })),
        shares: [0, 0.25, 0.5, 0.75, 1].map((share) => ({ share, y: y(share) })),
        gaps: props.gaps.filter((gap) => gap.to > from && gap.from < to).map((gap) => ({ ...gap, x: x(gap.from), width: Math.max(2, x(Math.min(gap.to, to)) - x(gap.from)) })),
      };
    });
    const at = computed(() => {
      if (cursor.value === null || !props.moments.length) return null;
      const ms = Math.min(props.to, Math.max(props.from, cursor.value));
      const moment = props.moments[placeAt(props.moments, ms)];
      return { x: x(ms), ms, moment, dots: ["a", "b"].filter((side) => moment && moment[side] !== null).map((side) => ({ side, y: y(moment[side]) })) };
    });
    const point = (event) => {
      const box = room.value.getBoundingClientRect();
      const along = (event.clientX - box.left - LEFT) / (width.value - LEFT - RIGHT);
      cursor.value = props.from + along * (props.to - props.from);
    };
    // From one moment that is kept to the next.
    const key = (event) => {
      const places = { ArrowLeft: -1, ArrowRight: 1 };
      if (!(event.key in places) || !props.moments.length) return;
      const last = props.moments.length - 1;
      const now = cursor.value === null ? last + 1 : placeAt(props.moments, cursor.value);
      cursor.value = props.moments[Math.min(last, Math.max(0, now + places[event.key]))].ms;
      event.preventDefault();
    };
    return { room, width, chart, at, point, key, clear: () => (cursor.value = null), HEIGHT, LEFT, RIGHT, TOP, BOTTOM, STRIP };
  },
  template: `
    <div ref="room" class="cv-chart cv-line-chart">
      <svg role="img" tabindex="0" :aria-label="'Overlap over time: ' + names.a + ', and ' + names.b + '. Left and right arrow keys go from moment to moment.'"
        :viewBox="'0 0 ' + width + ' ' + HEIGHT" :width="width" :height="HEIGHT" @pointermove="point" @pointerdown="point" @pointerleave="clear" @keydown="key" @blur="clear">
        <g v-for="each in chart.shares" :key="each.share">
          <line class="cv-gridline" :x1="LEFT" :x2="width - RIGHT" :y1="each.y" :y2="each.y"></line>
          <text class="cv-axis" :x="LEFT - 6" :y="each.y + 4" text-anchor="end">{{ Math.round(100 * each.share) }} %</text>
        </g>
        <rect v-for="gap in chart.gaps" :key="gap.from" class="cv-gap" :x="gap.x" :y="TOP" :width="gap.width" :height="HEIGHT - TOP - BOTTOM"><title>{{ gap.words }}</title></rect>
        <path class="cv-line-a" :d="chart.a"></path>
        <path class="cv-line-b" :d="chart.b"></path>
        <rect v-for="each in chart.stretches" :key="each.from" :class="'cv-found-' + each.foundBy" :x="each.from" :y="HEIGHT - BOTTOM + 6" :width="each.width" :height="STRIP"></rect>
        <g v-for="tick in chart.ticks" :key="tick.ms">
          <line class="cv-tick" :x1="tick.x" :x2="tick.x" :y1="HEIGHT - BOTTOM + STRIP + 8" :y2="HEIGHT - BOTTOM + STRIP + 13"></line>
          <text class="cv-axis" :x="Math.min(width - 22, tick.x)" :y="HEIGHT - BOTTOM + STRIP + 27" text-anchor="middle">{{ tick.words }}</text>
        </g>
        <g v-if="at">
          <line class="cv-cursor" :x1="at.x" :x2="at.x" :y1="TOP" :y2="HEIGHT - BOTTOM + STRIP + 6"></line>
          <circle v-for="dot in at.dots" :key="dot.side" :class="'cv-dot-' + dot.side" :cx="at.x" :cy="dot.y" r="4"></circle>
        </g>
      </svg>
      <slot :at="at"></slot>
    </div>`,
};
