// Who saw how much of whose view, as a small matrix in the order of groups; the strongest pairs in words below it.
import { computed, onMounted, onUnmounted, ref, watch } from "vue";
import { page } from "covista/ask.js";
import { onDark } from "covista/dark.js";
import { byLabel, byName, colourOf, percent } from "covista/looks.js";

const NAMES_PX = 46;
const BAR = 4;
const MOST_PAIRS = 20;

// Who stands in no group comes last.
const byGroup = (a, b) => {
  if (a.group === b.group) return byName(a.id, b.id);
  return a.group && b.group ? byLabel(a.group, b.group) : Number(!a.group) - Number(!b.group);
};

export default {
  props: { frame: { type: Object, default: null } },
  setup(props) {
    const [canvas, pointed] = [ref(null), ref("")];
    const dark = onDark();
    let [asked, side] = [null, 0];

    const robots = computed(() => [...(props.frame?.robots ?? [])].sort(byGroup));
    const shares = computed(() => {
      const place = new Map(robots.value.map((robot, k) => [robot.id, k]));
      const found = new Map();
      for (const { a, b, ofFirst, ofSecond } of props.frame?.edges ?? []) {
        const [i, j] = [place.get(a), place.get(b)];
        if (i === undefined || j === undefined) continue;
        found.set(i * robots.value.length + j, ofFirst);
        found.set(j * robots.value.length + i, ofSecond);
      }
      return found;
    });
    const pairs = computed(() =>
      [...(props.frame?.edges ?? [])].sort((p, q) => Math.max(q.ofFirst, q.ofSecond) - Math.max(p.ofFirst, p.ofSecond)).slice(0, MOST_PAIRS),
    );

    const named = () => robots.value.length > 0 && (side - NAMES_PX) / robots.value.length >= 11;
    const margin = () => (named() ? NAMES_PX : BAR + 2);
    const paint = () => {
      asked = null;
      if (!canvas.value || !side) return;
      const ratio = globalThis.devicePixelRatio || 1;
      if (canvas.value.width !== Math.round(side * ratio)) canvas.value.width = canvas.value.height = Math.round(side * ratio);
      const context = canvas.value.getContext("2d");
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      const [paper, soft, ink] = dark.value ? ["#1b2128", "#2a323b", "#7cc4ff"] : ["#ffffff", "#ececea", "#003f73"];
      context.fillStyle = paper;
      context.fillRect(0, 0, side, side);
      const count = robots.value.length;
      if (!count) return;
      const [from, cell] = [margin(), (side - margin()) / count];
      context.fillStyle = soft;
      context.fillRect(from, from, side - from, side - from);
      context.fillStyle = ink;
      for (const [place, share] of shares.value) {
        context.globalAlpha = 0.08 + 0.92 * share;
        context.fillRect(from + (place % count) * cell, from + Math.floor(place / count) * cell, Math.max(cell - 1, 1), Math.max(cell - 1, 1));
      }
      context.globalAlpha = 1;
      drawMargins(context, robots.value, from, cell);
    };
    const drawMargins = (context, sorted, from, cell) => {
      context.font = `${Math.min(12, cell)}px system-ui, sans-serif`;
      context.textBaseline = "middle";
      sorted.forEach(({ id, group }, k) => {
        const at = from + (k + 0.5) * cell;
        context.fillStyle = colourOf(group, dark.value);
        context.fillRect(from - BAR, from + k * cell, BAR - 1, Math.max(cell - 1, 1));
        context.fillRect(from + k * cell, from - BAR, Math.max(cell - 1, 1), BAR - 1);
        context.fillStyle = dark.value ? "#e8e8e8" : "#1c1c1c";
        context.save();
        if (named()) {
          context.fillText(id, 0, at, from - BAR - 3);
          context.translate(at, from - BAR - 3);
          context.rotate(-Math.PI / 2);
          context.fillText(id, 0, 0, from - BAR - 3);
        }
        context.restore();
        if (k && sorted[k - 1].group !== group) {
          context.fillRect(from, from + k * cell - 1, context.canvas.width, 1);
          context.fillRect(from + k * cell - 1, from, 1, context.canvas.height);
        }
      });
    };
    const wake = () => (asked ??= requestAnimationFrame(paint));
    watch([() => props.frame, dark], wake);
    const observer = new ResizeObserver(() => {
      side = canvas.value.clientWidth;
      wake();
    });
    onMounted(() => observer.observe(canvas.value));
    onUnmounted(() => {
      observer.disconnect();
      cancelAnimationFrame(asked);
    });

    const move = (event) => {
      const found = canvas.value.getBoundingClientRect();
      const count = robots.value.length;
      const cell = (side - margin()) / count;
      const [column, row] = [event.clientX - found.left, event.clientY - found.top].map((px) => Math.floor((px - margin()) / cell));
      const [of, by] = [robots.value[row], robots.value[column]];
      if (!of || !by || of === by) pointed.value = "";
      else pointed.value = sentence(of.id, by.id, shares.value.get(row * count + column) ?? 0);
    };
    const sentence = (of, by, share) => (share ? `${by} sees ${percent(share)} of ${of}'s view.` : `${by} sees nothing of ${of}'s view that is known.`);
    const words = computed(() => `Matrix of ${robots.value.length} robots: in each row, how much of its robot's view the others see. ${pairs.value.length} pairs are listed below.`);
    return { canvas, pointed, pairs, words, move, percent, page };
  },
  template: `
    <figure class="cv-small-matrix">
      <canvas ref="canvas" role="img" :aria-label="words" @pointermove="move" @pointerleave="pointed = ''"></canvas>
      <figcaption>{{ pointed || 'Row: whose view. Column: who sees it. The stronger the colour, the more of it.' }}</figcaption>
      <details v-if="pairs.length"><summary>Pairs in words</summary>
        <ul class="cv-list">
          <li v-for="each in pairs" :key="each.a + ' ' + each.b"><a :href="page('/pairs/' + each.a + '/' + each.b)">{{ each.a }} and {{ each.b }}</a>
            <span>{{ percent(each.ofFirst) }} and {{ percent(each.ofSecond) }} of their views</span></li>
        </ul>
      </details>
    </figure>`,
};
