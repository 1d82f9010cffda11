// A matrix of robots to look at and to walk through: with the mouse, a finger, or the arrow keys.
import { computed, shallowRef, watch } from "vue";
import { useCanvas } from "covista/matrix_canvas.js";

const STEPS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };

// Where robots stand in the order of a matrix; null for who is not in it.
function placeOf(matrix, pair) {
  if (!pair || !matrix) return null;
  const { robots, order } = matrix;
  const found = pair.map((name) => order.findIndex((place) => robots[place] === name));
  return found.includes(-1) ? null : found;
}

const robotsAt = (matrix, at) => at && at.map((k) => matrix.robots[matrix.order[k]]);

// Where a key leads from a row and a column, of which `last` is the last; undefined where it leads nowhere.
function stepped(key, [row, column], last) {
  if (key === "Home") return [row, 0];
  if (key === "End") return [row, last];
  const step = STEPS[key];
  const within = (at) => Math.min(last, Math.max(0, at));
  return step && [within(row + step[0]), within(column + step[1])];
}

function wordsOf(matrix) {
  if (!matrix) return "Matrix of robots, not there yet";
  const { order, blocks, title } = matrix;
  return `Matrix of ${order.length} robots ordered by ${blocks.filter((block) => block.label).length} groups. ${title}. Arrow keys choose a pair, Enter opens its page.`;
}

// How people point, click and walk; `under` tells which cell an event is on.
function useWalking(props, emit, hovered, under) {
  const move = (event) => {
    const at = event.pointerType === "touch" ? null : under(event);
    if (String(at) !== String(hovered.value)) hovered.value = at;
  };
  const leave = () => (hovered.value = null);
  const click = (event) => {
    const at = under(event);
    if (at) emit("choose", robotsAt(props.matrix, at), false);
  };
  const key = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !props.matrix?.order.length) return;
    const last = props.matrix.order.length - 1;
    const to = stepped(event.key, placeOf(props.matrix, props.chosen) ?? [0, 0], last);
    if (event.key === "Enter") emit("open");
    else if (to) emit("choose", robotsAt(props.matrix, to), true);
    else return;
    hovered.value = null;
    event.preventDefault();
  };
  return { move, leave, click, key };
}

export default {
  // `matrix`: { robots, values, order, blocks, measure, title }; `chosen`: [a, b], ids.
  props: { matrix: { type: Object, default: null }, chosen: { type: Array, default: null } },
  emits: ["hover", "choose", "open"],
  setup(props, { emit }) {
    const hovered = shallowRef(null);
    const { canvas, room, wake, anew, resize, under } = useCanvas(() => props.matrix, () => hovered.value ?? placeOf(props.matrix, props.chosen));
    // Who looks at a cell goes on looking at it when another matrix of as many robots comes.
    watch(() => props.matrix, (now, before) => {
      if (now?.order.length !== before?.order.length) hovered.value = null;
      resize();
      anew();
    });
    watch([() => props.chosen, hovered], wake);
    watch([hovered, () => props.matrix], ([at]) => emit("hover", robotsAt(props.matrix, at)));
    return { canvas, room, words: computed(() => wordsOf(props.matrix)), ...useWalking(props, emit, hovered, under) };
  },
  template: `
    <div ref="room" class="cv-matrix">
      <canvas ref="canvas" tabindex="0" role="img" :aria-label="words" @pointermove="move" @pointerleave="leave"
        @click="click" @keydown="key"></canvas>
    </div>`,
};
