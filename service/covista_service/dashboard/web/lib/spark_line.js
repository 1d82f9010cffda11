// How a number went over the last minutes, as a small line; null is a time of which nothing is known.
import { computed } from "vue";

const [WIDTH, HEIGHT, MARGIN] = [140, 30, 3];

export default {
  props: { values: { type: Array, required: true }, name: { type: String, required: true }, unit: { type: String, default: "" }, wide: Boolean },
  setup(props) {
    const known = computed(() => props.values.filter((value) => value !== null));
    const span = computed(() => [Math.min(0, ...known.value), Math.max(1, ...known.value)]);
    const lines = computed(() => {
      const [low, high] = span.value;
      const step = (WIDTH - 2 * MARGIN) / Math.max(props.values.length - 1, 1);
      const found = [[]];
      props.values.forEach((value, k) => {
        if (value === null) found.push([]);
        else found.at(-1).push(`${MARGIN + k * step},${HEIGHT - MARGIN - ((value - low) / (high - low)) * (HEIGHT - 2 * MARGIN)}`);
      });
      return found.filter((line) => line.length).map((line) => line.join(" "));
    });
    const words = computed(() => {
      if (!known.value.length) return `${props.name}: nothing known yet`;
      const round = (value) => Math.round(value * 10) / 10;
      return `${props.name} over the last minutes: from ${round(Math.min(...known.value))} to ${round(Math.max(...known.value))} ${props.unit}`.trim();
    });
    return { lines, words, WIDTH, HEIGHT };
  },
  template: `
    <svg class="cv-spark" :class="{ 'cv-spark-wide': wide }" :viewBox="'0 0 ' + WIDTH + ' ' + HEIGHT" :width="WIDTH" :height="HEIGHT"
      preserveAspectRatio="none" role="img" :aria-label="words">
      <polyline v-for="line in lines" :key="line" :points="line" vector-effect="non-scaling-stroke"></polyline>
    </svg>`,
};
