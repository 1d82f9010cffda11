// The swarm from above: moves, zooms, follows. What it shows is in lists beside it too, for who does not see it.
import { computed, onMounted, onUnmounted, ref, watch } from "vue";
import { onDark } from "covista/dark.js";
import { draw } from "covista/map_drawing.js";
import { Motion } from "covista/map_motion.js";
import { MapWindow } from "covista/map_window.js";
import { byLabel } from "covista/looks.js";
import GroupMark from "covista/group_mark.js";

const NEAR_PX = 14;
const STEP_PX = 60;
const EASE = 0.12;

export default {
  components: { GroupMark },
  props: { frame: { type: Object, default: null }, chosen: { type: Array, default: () => [] } },
  emits: ["choose"],
  setup(props, { emit }) {
    const canvas = ref(null);
    const dark = onDark();
    const view = new MapWindow();
    const motion = new Motion();
    const hovered = ref(null);
    const followed = ref("all");
    const still = matchMedia("(prefers-reduced-motion: reduce)");
    let drawn = 0;
    let asked = null;
    let pointers = new Map();
    let dragged = false;
    let revision = null;

    // Frames a second, for who measures: how often it was drawn, and when last.
    const paint = (now) => {
      asked = null;
      const context = canvas.value?.getContext("2d");
      if (!context) return;
      const shown = motion.now(now);
      const moving = follow(shown);
      const ratio = globalThis.devicePixelRatio || 1;
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      draw(context, view, shown, props.frame?.edges ?? [], { chosen: props.chosen, hovered: hovered.value, dark: dark.value });
      canvas.value.dataset.frames = ++drawn;
      if (moving || !motion.rests(now)) wake();
    };
    const wake = () => {
      asked ??= requestAnimationFrame(paint);
    };
    // Where the window goes by itself; whether it still goes.
    const follow = (shown) => {
      const placed = shown.filter((each) => each.at);
      if (followed.value === "none" || !placed.length) return false;
      const ease = drawn < 2 || still.matches ? 1 : EASE;
      const before = [...view.centre, view.pxPerM];
      const one = placed.find((each) => each.robot.id === followed.value);
      if (one) view.centreOn(one.at, ease);
      else view.fit(placed.map((each) => each.at), ease);
      return [...view.centre, view.pxPerM].some((value, k) => Math.abs(value - before[k]) > 1e-3 * view.pxPerM);
    };

    watch(() => props.frame, (frame) => {
      if (!frame) return;
      if (frame.past) motion.forget();
      motion.take(frame.robots, performance.now(), !still.matches && !frame.past);
      revision = frame.revision;
      if (canvas.value) canvas.value.dataset.revision = revision;
      wake();
    }, { immediate: true });
    watch([() => props.chosen, hovered, dark, followed], wake);

    const resize = () => {
      const { width, height } = canvas.value.getBoundingClientRect();
      const ratio = globalThis.devicePixelRatio || 1;
      canvas.value.width = Math.round(width * ratio);
      canvas.value.height = Math.round(height * ratio);
      view.size = [width, height];
      wake();
    };
    const observer = new ResizeObserver(resize);
    onMounted(() => {
      if (revision !== null) canvas.value.dataset.revision = revision;
      resize();
      observer.observe(canvas.value);
    });
    onUnmounted(() => {
      observer.disconnect();
      cancelAnimationFrame(asked);
    });

    const place = (event) => {
      const box = canvas.value.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const near = ([x, y]) => {
      let [found, least] = [null, NEAR_PX];
      for (const { robot, at } of motion.now(performance.now())) {
        if (!at) continue;
        const [u, v] = view.px(at);
        const distance = Math.hypot(u - x, v - y);
        if (distance < least) [found, least] = [robot.id, distance];
      }
      return found;
    };
    const free = () => {
      followed.value = "none";
      wake();
    };
    const down = (event) => {
      canvas.value.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, place(event));
      dragged = false;
    };
    const move = (event) => {
      const to = place(event);
      const from = pointers.get(event.pointerId);
      if (!from) {
        hovered.value = near(to);
        return;
      }
      if (pointers.size === 2) {
        const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
        const spread = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
        view.zoom(spread(to) / spread(from), other);
        dragged = true;
        free();
      } else if (dragged || Math.hypot(to[0] - from[0], to[1] - from[1]) > 4) {
        view.pan(to[0] - from[0], to[1] - from[1]);
        dragged = true;
        free();
      } else return;
      pointers.set(event.pointerId, to);
    };
    const up = (event) => {
      pointers.delete(event.pointerId);
      const found = near(place(event));
      if (!dragged && found && event.type === "pointerup") emit("choose", found);
    };
    const zoom = (factor, at) => {
      if (followed.value === "all") followed.value = "none";
      view.zoom(factor, at);
      wake();
    };
    const wheel = (event) => zoom(Math.exp(-0.0015 * event.deltaY), place(event));
    const keys = {
      "+": () => zoom(1.25), "=": () => zoom(1.25), "-": () => zoom(0.8), 0: () => (followed.value = "all"),
      ArrowLeft: () => step(STEP_PX, 0), ArrowRight: () => step(-STEP_PX, 0),
      ArrowUp: () => step(0, STEP_PX), ArrowDown: () => step(0, -STEP_PX),
    };
    const step = (dx, dy) => {
      view.pan(dx, dy);
      free();
    };
    const key = (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey) return;
      keys[event.key]();
      event.preventDefault();
    };

    const names = computed(() => (props.frame?.robots ?? []).filter((robot) => robot.at).map((robot) => robot.id));
    const labels = computed(() => [...new Set((props.frame?.robots ?? []).map((robot) => robot.group).filter(Boolean))].sort(byLabel));
    const words = computed(() => {
      const robots = props.frame?.robots ?? [];
      const silent = robots.filter((robot) => robot.status !== "live").length;
      return `Map from above: ${robots.length} robots in ${labels.value.length} groups, ${silent} of them silent. Arrow keys move it, plus and minus zoom, 0 shows all.`;
    });
    return { canvas, hovered, followed, names, labels, words, down, move, up, wheel, key, zoom };
  },
  template: `
    <figure class="cv-map">
      <canvas ref="canvas" tabindex="0" role="img" :aria-label="words" @pointerdown="down" @pointermove="move" @pointerup="up"
        @pointercancel="up" @pointerleave="hovered = null" @wheel.prevent="wheel" @keydown="key"></canvas>
      <div class="cv-tools">
        <button @click="zoom(1.25)" aria-label="Zoom in">+</button>
        <button @click="zoom(0.8)" aria-label="Zoom out">−</button>
        <label>Follow <select v-model="followed">
          <option value="all">all</option><option value="none">nobody</option>
          <option v-for="name in names" :key="name" :value="name">{{ name }}</option></select></label>
      </div>
      <figcaption class="cv-legend">
        <group-mark v-for="label in labels" :key="label" :label="label"></group-mark>
        <span>filled: live</span><span>dashed: stale, silent for a while</span><span>crossed out: gone</span>
        <span>line: views in common, the thicker the more</span><span>wedge: field of view, its beginning</span><span>tail: the last minute's way</span>
      </figcaption>
    </figure>`,
};
