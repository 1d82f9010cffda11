// Who saw how much of whose view, as a small matrix in the order of groups; the strongest pairs in words below it.
import { computed, ref, watch } from "vue";
import { page } from "covista/ask.js";
import { onDark } from "covista/dark.js";
import { byLabel, byName, colourOf, percent } from "covista/looks.js";
import { contextOf, usePainting } from "covista/painting.js";

const NAMES_PX = 46;
const NAMED_FROM_PX = 11;
const BAR = 4;
const MOST_PAIRS = 20;
// Of more robots the station tells only the strongest pairs of each.
const THINNED_ABOVE = 60;
const LIGHT = { paper: "#ffffff", none: "#ececea", full: "#003f73", ink: "#1c1c1c" };
const DARK = { paper: "#1b2128", none: "#2a323b", full: "#7cc4ff", ink: "#e8e8e8" };

// Who stands in no group comes last.
const byGroup = (a, b) => {
  if (a.group === b.group) return byName(a.id, b.id);
  return a.group && b.group ? byLabel(a.group, b.group) : Number(!a.group) - Number(!b.group);
};

// Which share of the row's view the column sees, by row times count plus column.
function sharesOf(robots, edges) {
  const place = new Map(robots.map((robot, k) => [robot.id, k]));
  const found = new Map();
  for (const { a, b, ofFirst, ofSecond } of edges) {
    const [i, j] = [place.get(a), place.get(b)];
    if (i === undefined || j === undefined) continue;
    found.set(i * robots.length + j, ofFirst);
    found.set(j * robots.length + i, ofSecond);
  }
  return found;
}

// Where cells begin and how long they are, in a square so long.
function layoutOf(count, side) {
  const named = count > 0 && (side - NAMES_PX) / count >= NAMED_FROM_PX;
  const from = named ? NAMES_PX : BAR + 2;
  return { named, from, cell: (side - from) / count };
}

function draw(context, side, robots, shares, dark) {
  const [look, count] = [dark ? DARK : LIGHT, robots.length];
  context.fillStyle = look.paper;
  context.fillRect(0, 0, side, side);
  if (!count) return;
  const { named, from, cell } = layoutOf(count, side);
  const length = Math.max(cell - 1, 1);
  context.fillStyle = look.none;
  context.fillRect(from, from, side - from, side - from);
  context.fillStyle = look.full;
  for (const [place, share] of shares) {
    context.globalAlpha = 0.08 + 0.92 * share;
    context.fillRect(from + (place % count) * cell, from + Math.floor(place / count) * cell, length, length);
  }
  context.globalAlpha = 1;
  robots.forEach(({ group }, k) => {
    const at = from + k * cell;
    context.fillStyle = colourOf(group, dark);
    context.fillRect(from - BAR, at, BAR - 1, length);
    context.fillRect(at, from - BAR, length, BAR - 1);
    context.fillStyle = look.ink;
    if (!k || robots[k - 1].group === group) return;
    context.fillRect(from, at - 1, side - from, 1);
    context.fillRect(at - 1, from, 1, side - from);
  });
  if (named) drawNames(context, robots, from, cell, look.ink);
}

function drawNames(context, robots, from, cell, ink) {
  const room = from - BAR - 3;
  context.font = `${Math.min(12, cell)}px system-ui, sans-serif`;
  context.textBaseline = "middle";
  context.fillStyle = ink;
  robots.forEach(({ id }, k) => {
    const at = from + (k + 0.5) * cell;
    context.fillText(id, 0, at, room);
    context.save();
    context.translate(at, room);
    context.rotate(-Math.PI / 2);
    context.fillText(id, 0, 0, room);
    context.restore();
  });
}

export default {
  props: { frame: { type: Object, default: null } },
  setup(props) {
    const [canvas, pointed, dark] = [ref(null), ref(""), onDark()];
    let side = 0;

    const robots = computed(() => [...(props.frame?.robots ?? [])].sort(byGroup));
    const shares = computed(() => sharesOf(robots.value, props.frame?.edges ?? []));
    const strength = ({ ofFirst, ofSecond }) => Math.max(ofFirst, ofSecond);
    const pairs = computed(() => [...(props.frame?.edges ?? [])].sort((p, q) => strength(q) - strength(p)).slice(0, MOST_PAIRS));
    const wake = usePainting(canvas, () => {
      if (side) draw(contextOf(canvas.value, side, side), side, robots.value, shares.value, dark.value);
    }, () => (side = canvas.value.clientWidth));
    watch([() => props.frame, dark], wake);

    const move = (event) => {
      const { from, cell } = layoutOf(robots.value.length, side);
      const [column, row] = [event.offsetX, event.offsetY].map((px) => Math.floor((px - from) / cell));
      const [of, by] = [robots.value[row], robots.value[column]];
      if (!of || !by || of === by) pointed.value = "";
      else pointed.value = sentence(of.id, by.id, shares.value.get(row * robots.value.length + column));
    };
    const sentence = (of, by, share) => {
      if (share !== undefined) return `${by} sees ${percent(share)} of ${of}'s view.`;
      const thinned = robots.value.length > THINNED_ABOVE ? ", or each shares more with others" : "";
      return `That ${by} sees any of ${of}'s view is not known, or it is next to nothing${thinned}.`;
    };
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
