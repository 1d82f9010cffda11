// One setting to try: what it does, its value, and what it was.
import { computed } from "vue";
import { isRange, same, word } from "covista/settings_words.js";
import Dial from "covista/dial.js";

const SIGMA_M = 3;

export default {
  components: { Dial },
  props: {
    choice: { type: Object, required: true },
    value: { type: [String, Number, Object], required: true },
    was: { type: [String, Number, Object], required: true },
    robots: { type: Number, default: 0 },
  },
  emits: ["change"],
  setup(props, { emit }) {
    const name = props.choice.name;
    const changed = computed(() => !same(props.value, props.was));
    // Which of its ways to be said is chosen.
    const way = computed(() => {
      if (props.choice.kind === "groups") return isRange(props.value) ? "range" : props.value === "auto" ? "auto" : "number";
      if (props.choice.kind === "sigma") return typeof props.value === "number" ? "metres" : props.value;
      return props.value;
    });
    const explained = computed(() => props.choice.options.find(({ value }) => value === way.value)?.says);
    const far = computed(() => Math.max(props.robots, 8));
    const numbered = computed(() => (isRange(props.value) ? props.value.max : typeof props.value === "number" ? props.value : 2));
    const choose = (chosen) => {
      const to = { number: numbered.value, range: { min: 1, max: numbered.value }, metres: SIGMA_M }[chosen] ?? chosen;
      emit("change", to);
    };
    const set = (value) => emit("change", value);
    const bound = (side, value) => emit("change", { ...props.value, [side]: value });
    const titles = { number: "a number", range: "from ... to ..." };
    const title = (value) => (props.choice.kind === "groups" ? titles[value] ?? value : value);
    const ids = { control: `cv-set-${name}`, says: `cv-says-${name}` };
    return { changed, way, explained, far, choose, set, bound, title, ids, word };
  },
  template: `
    <div class="cv-setting" :class="{ 'cv-changed': changed }" :data-setting="choice.name">
      <p class="cv-setting-head">
        <label v-if="choice.options.length" :for="ids.control">{{ choice.label }}</label>
        <span v-else class="cv-label">{{ choice.label }}</span>
        <code>{{ choice.name }}</code>
        <span v-if="changed" class="cv-was">was {{ word(was) }}
          <button type="button" :aria-label="choice.label + ' back to ' + word(was)" @click="set(was)">Back</button></span>
      </p>
      <p class="cv-says" :id="ids.says">{{ choice.says }}<template v-if="explained">{{ " " }}<b>{{ title(way) }}:</b> {{ explained }}</template></p>
      <select v-if="choice.options.length" :id="ids.control" :value="way" :aria-describedby="ids.says" @change="choose($event.target.value)">
        <option v-for="option in choice.options" :key="option.value" :value="option.value">{{ title(option.value) }}</option>
      </select>
      <template v-if="choice.kind === 'groups'">
        <dial v-if="way === 'number'" :value="value" :least="choice.least" :most="choice.most" :far="far" :step="1" name="Number of groups" @change="set"></dial>
        <template v-if="way === 'range'">
          <dial :value="value.min" :least="choice.least" :most="choice.most" :far="far" :step="1" name="At least" unit="at least" @change="bound('min', $event)"></dial>
          <dial :value="value.max" :least="choice.least" :most="choice.most" :far="far" :step="1" name="At most" unit="at most" @change="bound('max', $event)"></dial>
        </template>
      </template>
      <dial v-else-if="choice.kind === 'sigma' && way === 'metres'" :value="value" :least="choice.least" :most="choice.most" :far="choice.far"
        :step="choice.step" :above="choice.above" unit="m" name="Near, in metres" @change="set"></dial>
      <dial v-else-if="choice.kind === 'number' || choice.kind === 'count'" :value="value" :least="choice.least" :most="choice.most"
        :far="choice.far ?? far" :step="choice.step" :above="choice.above" :unit="choice.unit" :name="choice.label" :described="ids.says" @change="set"></dial>
    </div>`,
};
