// What happened, in words, the newest first: each a link that goes back there.
import { computed } from "vue";
import { GLYPHS } from "covista/bands_drawing.js";
import { length, msOf, spoken } from "covista/moments.js";

export const KINDS = [
  { name: "Groups", kinds: ["join", "leave", "split", "merge", "moved"] },
  { name: "Robots", kinds: ["status"] },
  { name: "Settings", kinds: ["settings"] },
  { name: "Warnings", kinds: ["warning"] },
];

export default {
  props: {
    events: { type: Object, required: true },
    sinceMs: { type: Number, required: true },
    time: { type: String, default: null },
    chosen: { type: Array, required: true },
    linkOf: { type: Function, required: true },
    heading: { type: String, default: "What happened" },
    kinds: { type: Array, default: () => KINDS },
    within: { type: String, default: "in this time" },
    // Whether the links lead to another page.
    away: { type: Boolean, default: false },
  },
  emits: ["scrub", "choose"],
  setup(props, { emit }) {
    const shown = computed(() => [...props.events.items].reverse().filter((event) => msOf(event.time) >= props.sinceMs));
    const cut = computed(() => (props.events.reachesMs > props.sinceMs + 2000 ? spoken(props.events.reachesMs) : ""));
    const turn = (name, on) => emit("choose", props.kinds.map((each) => each.name).filter((each) => (each === name ? on : props.chosen.includes(each))));
    const go = (event, time) => {
      if (props.away) return;
      event.preventDefault();
      emit("scrub", time);
    };
    return { go, GLYPHS, shown, cut, turn, length, msOf, spoken };
  },
  template: `
    <section class="cv-card cv-events" aria-labelledby="cv-events">
      <h2 id="cv-events">{{ heading }}</h2>
      <fieldset class="cv-pick"><legend class="cv-unseen">Show</legend>
        <label v-for="each in kinds" :key="each.name"><input type="checkbox" :checked="chosen.includes(each.name)" @change="turn(each.name, $event.target.checked)">
          {{ each.name }} <span aria-hidden="true">{{ each.kinds.map((kind) => GLYPHS[kind]).join(' ') }}</span></label>
      </fieldset>
      <p v-if="!chosen.length">Choose what to show.</p>
      <p v-else-if="!shown.length">Nothing of this kind happened {{ within }}.</p>
      <p v-if="cut && shown.length">These are the newest; what happened before {{ cut }} is left out. Choose a shorter time to see it.</p>
      <ol class="cv-list cv-events-list" v-if="shown.length" tabindex="0" aria-label="Events, the newest first">
        <li v-for="event in shown" :key="event.id">
          <a :href="linkOf(event.time)" :aria-current="event.time === time ? 'time' : null" @click.exact="go($event, event.time)">{{ spoken(msOf(event.time)) }}</a>
          <span><span aria-hidden="true">{{ GLYPHS[event.event] }}</span> {{ event.text }}<template v-if="event.by"> (by {{ event.by }})</template></span>
        </li>
      </ol>
    </section>`,
};
