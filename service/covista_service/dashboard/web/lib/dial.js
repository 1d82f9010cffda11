// A number, by a slider for the hand and a box for who knows it; what is out of bounds is told and goes no further.
import { ref, watch } from "vue";

export default {
  props: {
    value: { type: Number, required: true },
    least: { type: Number, default: 0 },
    most: { type: Number, default: Infinity },
    // Where the slider ends: what is larger can be typed.
    far: { type: Number, default: null },
    step: { type: Number, default: 0.01 },
    above: { type: Boolean, default: false },
    unit: { type: String, default: "" },
    name: { type: String, required: true },
    described: { type: String, default: null },
  },
  emits: ["change"],
  setup(props, { emit }) {
    const typed = ref(null);
    const problem = ref("");
    const whole = Number.isInteger(props.step);
    const set = (text) => {
      const number = text.trim() === "" ? NaN : Number(text);
      const low = props.above ? number <= props.least : number < props.least;
      if (!Number.isFinite(number) || low || number > props.most || (whole && !Number.isInteger(number))) {
        typed.value = text;
        const most = Number.isFinite(props.most) ? ` to ${props.most}` : "";
        problem.value = `A ${whole ? "whole " : ""}number from ${props.above ? "above " : ""}${props.least}${most}`;
        return;
      }
      typed.value = null;
      problem.value = "";
      emit("change", number);
    };
    watch(() => props.value, () => {
      typed.value = null;
      problem.value = "";
    });
    const slide = (event) => set(event.target.value);
    return { typed, problem, set, slide };
  },
  template: `
    <span class="cv-dial">
      <input type="range" :aria-label="name + ', slider'" :aria-describedby="described" :value="value" :step="step"
        :min="above ? least + step : least" :max="far ?? most" @input="slide">
      <input type="text" inputmode="decimal" size="6" autocomplete="off" :aria-label="name" :aria-describedby="described"
        :aria-invalid="problem !== ''" :value="typed ?? Number(value.toPrecision(6))" @change="set($event.target.value)">
      <span v-if="unit" class="cv-unit">{{ unit }}</span>
      <span v-if="problem" class="cv-problem" role="alert">{{ problem }}</span>
    </span>`,
};
