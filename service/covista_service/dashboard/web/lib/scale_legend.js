// What the colours of a matrix mean, with numbers.
import { computed } from "vue";
import { colourAt, css } from "covista/colour_scale.js";
import { onDark } from "covista/dark.js";

const STRIPES = 64;

export default {
  props: { measure: { type: Object, required: true } },
  setup(props) {
    const dark = onDark();
    const { strength, text } = { strength: (value) => props.measure.strength(value), text: (value) => props.measure.text(value) };
    const stripes = computed(() =>
      Array.from({ length: STRIPES }, (_, k) => css(colourAt(strength((props.measure.top * (k + 0.5)) / STRIPES), dark.value))),
    );
    const ticks = computed(() => props.measure.ticks.map((value, k, all) => ({ at: 100 * (k / (all.length - 1)), text: text(value) })));
    return { stripes, ticks, STRIPES };
  },
  template: `
    <div class="cv-scale">
      <svg :viewBox="'0 0 ' + STRIPES + ' 1'" preserveAspectRatio="none" aria-hidden="true" shape-rendering="crispEdges">
        <rect v-for="(colour, k) in stripes" :key="k" :x="k" y="0" width="1.05" height="1" :fill="colour"></rect>
      </svg>
      <p class="cv-ticks"><span v-for="tick in ticks" :key="tick.at">{{ tick.text }}</span></p>
      <p class="cv-unknown"><svg viewBox="0 0 20 14" width="20" height="14" aria-hidden="true">
        <path d="M-4 14L10 0M2 14L16 0M8 14L22 0M14 14L28 0"></path></svg> not known</p>
    </div>`,
};
