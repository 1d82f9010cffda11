// A matrix of robots to look at and to walk through: with the mouse, a finger, or the arrow keys.
import { onMounted, onUnmounted, ref, shallowRef, watch, computed } from "vue";
import { onDark } from "covista/dark.js";
import { cellUnder, drawChosen, drawMatrix, layoutOf, sideOf } from "covista/matrix_drawing.js";

const LEAST_PX = 240;
const BELOW_PX = 265;
const STEPS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };

export default {
  // `matrix`: { robots, values, order, blocks, measure, title }; `chosen`: [a, b], ids.
  props: { matrix: { type: Object, default: null }, chosen: { type: Array, default: null } },
  emits: ["hover", "choose", "open"],
  setup(props, { emit }) {
    const canvas = ref(null);
    const room = ref(null);
    const dark = onDark();
    const hovered = shallowRef(null);
    let layout = null;
    // All but what is chosen, drawn once for each matrix.
    let ground = null;
    let asked = null;
    let drawn = 0;

    const colour = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
    const theme = () => ({ dark: dark.value, ink: colour("--cv-ink"), paper: colour("--cv-card"), soft: colour("--cv-soft") });
    const paint = () => {
      asked = null;
      const context = canvas.value?.getContext("2d");
      if (!context || !props.matrix || !room.value.clientWidth) return;
      const { width, height } = canvas.value;
      const ratio = globalThis.devicePixelRatio || 1;
      const looks = { ...theme(), ratio };
      if (!ground) {
        ground = new OffscreenCanvas(width, height);
        const pen = ground.getContext("2d");
        const { matrix } = props;
        layout = layoutOf(matrix.order.length, width / ratio, matrix.robots, matrix.blocks);
        pen.scale(ratio, ratio);
        if (matrix.order.length) drawMatrix(pen, layout, matrix, looks);
      }
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, width, height);
      context.drawImage(ground, 0, 0);
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      const at = hovered.value ?? placeOf(props.chosen);
      if (at) drawChosen(context, layout, at, looks);
      canvas.value.dataset.drawn = ++drawn;
    };
    const wake = () => {
      asked ??= requestAnimationFrame(paint);
    };
    const anew = () => {
      ground = null;
      wake();
    };
    // Where robots stand in the order; null for who is not in the matrix.
    const placeOf = (pair) => {
      if (!pair || !props.matrix) return null;
      const { robots, order } = props.matrix;
      const found = pair.map((name) => order.findIndex((place) => robots[place] === name));
      return found.includes(-1) ? null : found;
    };
    const robotsAt = (at) => at && at.map((k) => props.matrix.robots[props.matrix.order[k]]);

    // Who looks at a cell goes on looking at it when another matrix of as many robots comes.
    watch(() => props.matrix, (now, before) => {
      if (now?.order.length !== before?.order.length) hovered.value = null;
      resize();
      anew();
    });
    watch(dark, anew);
    watch([() => props.chosen, hovered], wake);
    watch([hovered, () => props.matrix], ([at]) => emit("hover", robotsAt(at)));

    const resize = () => {
      const width = room.value.clientWidth;
      // Hidden as long as there is nothing to show.
      if (!width) return;
      const side = Math.max(LEAST_PX, Math.min(width, globalThis.innerHeight - BELOW_PX));
      const ratio = globalThis.devicePixelRatio || 1;
      const fits = sideOf(props.matrix?.order.length ?? 0, Math.min(width, side), props.matrix?.robots ?? [], props.matrix?.blocks ?? []);
      const length = Math.round(fits * ratio);
      if (canvas.value.width === length) return;
      canvas.value.width = canvas.value.height = length;
      canvas.value.style.width = canvas.value.style.height = `${length / ratio}px`;
      anew();
    };
    const observer = new ResizeObserver(resize);
    onMounted(() => {
      resize();
      observer.observe(room.value);
    });
    onUnmounted(() => {
      observer.disconnect();
      cancelAnimationFrame(asked);
    });

    const under = (event) => {
      if (!layout || !props.matrix) return null;
      const box = canvas.value.getBoundingClientRect();
      return cellUnder(layout, [event.clientX - box.left, event.clientY - box.top]);
    };
    const move = (event) => {
      const at = event.pointerType === "touch" ? null : under(event);
      if (String(at) !== String(hovered.value)) hovered.value = at;
    };
    const click = (event) => {
      const at = under(event);
      if (at) emit("choose", robotsAt(at), false);
    };
    const key = (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !props.matrix?.order.length) return;
      const last = props.matrix.order.length - 1;
      const [row, column] = placeOf(props.chosen) ?? [0, 0];
      const step = STEPS[event.key];
      if (event.key === "Enter") emit("open");
      else if (event.key === "Home") emit("choose", robotsAt([row, 0]), true);
      else if (event.key === "End") emit("choose", robotsAt([row, last]), true);
      else if (step) {
        const within = (at) => Math.min(last, Math.max(0, at));
        emit("choose", robotsAt([within(row + step[0]), within(column + step[1])]), true);
      } else return;
      hovered.value = null;
      event.preventDefault();
    };
    const words = computed(() => {
      if (!props.matrix) return "Matrix of robots, not there yet";
      const { order, blocks, title } = props.matrix;
      return `Matrix of ${order.length} robots ordered by ${blocks.filter((block) => block.label).length} groups. ${title}. Arrow keys choose a pair, Enter opens its page.`;
    });
    return { canvas, room, words, move, click, key, leave: () => (hovered.value = null) };
  },
  template: `
    <div ref="room" class="cv-matrix">
      <canvas ref="canvas" tabindex="0" role="img" :aria-label="words" @pointermove="move" @pointerleave="leave"
        @click="click" @keydown="key"></canvas>
    </div>`,
};
