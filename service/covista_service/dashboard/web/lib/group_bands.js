// Groups over time as bands, to look at and to go back in: by dragging over them, or by the slider below.
import { computed, ref, watch } from "vue";
import { drawHead, drawRows, GUTTER, HEAD, rowHeight, runsOf, Scale } from "covista/bands_drawing.js";
import { onDark } from "covista/dark.js";
import { clock, msOf, spoken } from "covista/moments.js";
import { contextOf, usePainting } from "covista/painting.js";

const NEAR_PX = 8;
const STEPS = 300;

// The slider's data-time is the time that is looked at as the address has it: its value is rounded to its steps.

// The event that is drawn near a place of the scale, the nearest of them; null where none is.
function nearest(events, scale, x) {
  const apart = (event) => Math.abs(scale.px(event.ms) - x);
  return events.filter((event) => apart(event) <= NEAR_PX).sort((a, b) => apart(a) - apart(b))[0] ?? null;
}

// What is drawn at a place of the rows, in words.
function wordsOfRow(bands, scale, [x, y]) {
  const robot = bands.robots[Math.floor(y / rowHeight(bands.robots.length))];
  if (!robot || x < GUTTER) return robot ?? "";
  const ms = scale.ms(x);
  const gap = bands.gaps.find((each) => each.since_ms <= ms && ms <= each.until_ms);
  const run = runsOf(bands, robot).find(({ from, to }) => from <= ms && ms < to);
  const where = !run || run.label === "" ? "not known" : run.label === null ? "in no group" : `in ${run.label}`;
  return `${clock(ms)} ${robot} ${where}` + (gap ? `; the history has a gap: ${gap.reason}` : "");
}

export default {
  props: {
    bands: { type: Object, required: true },
    events: { type: Array, default: () => [] },
    // The time that is looked at, as RFC 3339; null is now.
    time: { type: String, default: null },
  },
  emits: ["scrub"],
  setup(props, { emit }) {
    const [head, rows, pointed] = [ref(null), ref(null), ref("")];
    const dark = onDark();
    let width = 0;

    const timeMs = computed(() => (props.time === null ? null : msOf(props.time)));
    const scale = () => new Scale(props.bands.since_ms, props.bands.until_ms, width);
    const sorted = computed(() => props.events.map((event) => ({ ...event, ms: msOf(event.time) })));

    const wake = usePainting(rows, () => {
      if (!width) return;
      const count = props.bands.robots.length;
      const height = Math.max(1, rowHeight(count) * count);
      head.value.style.height = `${HEAD}px`;
      rows.value.style.height = `${height}px`;
      drawHead(contextOf(head.value, width, HEAD), scale(), sorted.value, timeMs.value, dark.value);
      drawRows(contextOf(rows.value, width, height), scale(), props.bands, timeMs.value, dark.value);
    }, () => (width = rows.value.clientWidth));
    watch([() => props.bands, sorted, timeMs, dark], wake);

    const scrub = (ms) => emit("scrub", new Date(Math.round(ms)).toISOString());
    const eventAt = (event) => (event.currentTarget === head.value ? nearest(sorted.value, scale(), event.offsetX) : null);
    const down = (event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      const found = eventAt(event);
      if (found) emit("scrub", found.time);
      else scrub(scale().ms(event.offsetX));
    };
    const move = (event) => {
      if (event.buttons) scrub(scale().ms(event.offsetX));
      const found = eventAt(event);
      if (event.currentTarget === rows.value) pointed.value = wordsOfRow(props.bands, scale(), [event.offsetX, event.offsetY]);
      else pointed.value = found ? `${clock(found.ms)} ${found.text}` : "";
    };

    const step = computed(() => Math.max(1000, Math.round((props.bands.until_ms - props.bands.since_ms) / STEPS)));
    const slid = (event) => scrub(Number(event.target.value));
    const words = computed(() => {
      const { robots, since_ms: since, until_ms: until } = props.bands;
      return `Groups of ${robots.length} robots from ${spoken(since)} to ${spoken(until)}, a row each. The slider below goes back in time; the lists tell the groups of that time and what happened.`;
    });
    const valueWords = computed(() => (timeMs.value === null ? "now" : spoken(timeMs.value)));
    return { head, rows, pointed, timeMs, step, slid, words, valueWords, down, move };
  },
  template: `
    <figure class="cv-bands">
      <div class="cv-bands-box">
        <canvas ref="head" class="cv-bands-head" aria-hidden="true" @pointerdown="down" @pointermove="move" @pointerleave="pointed = ''"></canvas>
        <canvas ref="rows" role="img" :aria-label="words" @pointerdown="down" @pointermove="move" @pointerleave="pointed = ''"></canvas>
      </div>
      <input type="range" class="cv-bands-slider" aria-label="Time" :aria-valuetext="valueWords" :min="bands.since_ms" :max="bands.until_ms"
        :step="step" :data-time="time" :value="timeMs ?? bands.until_ms" @input="slid">
      <figcaption class="cv-bands-pointed">{{ pointed || 'Drag over the bands, or use the slider, to go back in time.' }}</figcaption>
    </figure>`,
};
