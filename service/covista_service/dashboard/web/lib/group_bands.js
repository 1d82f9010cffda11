// Groups over time as bands, to look at and to go back in: by dragging over them, or by the slider below.
import { computed, onMounted, onUnmounted, ref, watch } from "vue";
import { drawHead, drawRows, GUTTER, HEAD, rowHeight, runsOf, Scale } from "covista/bands_drawing.js";
import { onDark } from "covista/dark.js";
import { clock, msOf, spoken } from "covista/moments.js";

const NEAR_PX = 8;
const STEPS = 300;

export default {
  props: {
    bands: { type: Object, required: true },
    events: { type: Array, default: () => [] },
    // The time that is looked at, as RFC 3339; null is now.
    time: { type: String, default: null },
  },
  emits: ["scrub"],
  setup(props, { emit }) {
    const [box, head, rows] = [ref(null), ref(null), ref(null)];
    const dark = onDark();
    const pointed = ref("");
    let [asked, width] = [null, 0];

    const timeMs = computed(() => (props.time === null ? null : msOf(props.time)));
    const scale = () => new Scale(props.bands.since_ms, props.bands.until_ms, width);
    const sorted = computed(() => props.events.map((event) => ({ ...event, ms: msOf(event.time) })));

    const contextOf = (canvas, height) => {
      const ratio = globalThis.devicePixelRatio || 1;
      const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
      if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
      canvas.style.height = `${height}px`;
      const context = canvas.getContext("2d");
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      return context;
    };
    const paint = () => {
      asked = null;
      if (!rows.value || !width) return;
      const count = props.bands.robots.length;
      drawHead(contextOf(head.value, HEAD), scale(), sorted.value, timeMs.value, dark.value);
      drawRows(contextOf(rows.value, Math.max(1, rowHeight(count) * count)), scale(), props.bands, timeMs.value, dark.value);
    };
    const wake = () => (asked ??= requestAnimationFrame(paint));
    watch([() => props.bands, sorted, timeMs, dark], wake);
    const observer = new ResizeObserver(() => {
      width = rows.value.clientWidth;
      wake();
    });
    onMounted(() => observer.observe(rows.value));
    onUnmounted(() => {
      observer.disconnect();
      cancelAnimationFrame(asked);
    });

    const at = (event) => event.clientX - event.currentTarget.getBoundingClientRect().left;
    const nearest = (x) => {
      const [place, reach] = [scale(), []];
      for (const event of sorted.value) {
        const apart = Math.abs(place.px(event.ms) - x);
        if (apart <= NEAR_PX) reach.push([apart, event]);
      }
      return reach.sort((a, b) => a[0] - b[0])[0]?.[1] ?? null;
    };
    const scrub = (ms) => emit("scrub", new Date(Math.round(ms)).toISOString());
    const down = (event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      const found = event.currentTarget === head.value ? nearest(at(event)) : null;
      if (found) emit("scrub", found.time);
      else scrub(scale().ms(at(event)));
    };
    const move = (event) => {
      const x = at(event);
      if (event.buttons) scrub(scale().ms(x));
      pointed.value = event.currentTarget === head.value ? wordsOfEvent(nearest(x)) : wordsOfRow(event, x);
    };
    const wordsOfEvent = (event) => (event ? `${clock(event.ms)} ${event.text}` : "");
    const wordsOfRow = (event, x) => {
      const top = event.clientY - rows.value.getBoundingClientRect().top;
      const robot = props.bands.robots[Math.floor(top / rowHeight(props.bands.robots.length))];
      if (!robot || x < GUTTER) return robot ?? "";
      const ms = scale().ms(x);
      const gap = props.bands.gaps.find((each) => each.since_ms <= ms && ms <= each.until_ms);
      const run = runsOf(props.bands, robot).find(({ from, to }) => from <= ms && ms < to);
      const where = !run || run.label === "" ? "not known" : run.label === null ? "in no group" : `in ${run.label}`;
      return `${clock(ms)} ${robot} ${where}` + (gap ? `; the history has a gap: ${gap.reason}` : "");
    };

    const step = computed(() => Math.max(1000, Math.round((props.bands.until_ms - props.bands.since_ms) / STEPS)));
    const slid = (event) => scrub(Number(event.target.value));
    const words = computed(() => {
      const { robots, since_ms: since, until_ms: until } = props.bands;
      return `Groups of ${robots.length} robots from ${spoken(since)} to ${spoken(until)}, a row each. The slider below goes back in time; the lists tell the groups of that time and what happened.`;
    });
    const valueWords = computed(() => (timeMs.value === null ? "now" : spoken(timeMs.value)));
    return { box, head, rows, pointed, timeMs, step, slid, words, valueWords, down, move };
  },
  template: `
    <figure class="cv-bands">
      <div class="cv-bands-box" ref="box">
        <canvas ref="head" class="cv-bands-head" aria-hidden="true" @pointerdown="down" @pointermove="move" @pointerleave="pointed = ''"></canvas>
        <canvas ref="rows" role="img" :aria-label="words" @pointerdown="down" @pointermove="move" @pointerleave="pointed = ''"></canvas>
      </div>
      <input type="range" class="cv-bands-slider" aria-label="Time" :aria-valuetext="valueWords" :min="bands.since_ms" :max="bands.until_ms"
        :step="step" :value="timeMs ?? bands.until_ms" @input="slid">
      <figcaption class="cv-bands-pointed">{{ pointed || 'Drag over the bands, or use the slider, to go back in time.' }}</figcaption>
    </figure>`,
};
