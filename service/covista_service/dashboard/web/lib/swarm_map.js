// The swarm from above: moves, zooms, follows. What it shows is in lists beside it too, for who does not see it.
import { computed, onMounted, ref, watch } from "vue";
import { onDark } from "covista/dark.js";
import { byLabel, counted } from "covista/looks.js";
import { draw } from "covista/map_drawing.js";
import { Motion } from "covista/map_motion.js";
import { usePointing } from "covista/map_pointing.js";
import { MapWindow } from "covista/map_window.js";
import { contextOf, usePainting } from "covista/painting.js";
import GroupMark from "covista/group_mark.js";

const EASE = 0.12;

// Where the window goes by itself to show "all", "none" or one robot; whether it still goes.
function follow(view, followed, shown, ease) {
  const placed = shown.filter((each) => each.at);
  if (followed === "none" || !placed.length) return false;
  const before = [...view.centre, view.pxPerM];
  const one = placed.find((each) => each.robot.id === followed);
  if (one) view.centreOn(one.at, ease);
  else view.fit(placed.map((each) => each.at), ease);
  return [...view.centre, view.pxPerM].some((value, k) => Math.abs(value - before[k]) > 1e-3 * view.pxPerM);
}

function inWords(robots, labels) {
  const silent = robots.filter((robot) => robot.status !== "live").length;
  const [who, groups] = [counted(robots.length, "robot"), counted(labels.length, "group")];
  return `Map from above: ${who} in ${groups}, ${silent} of them silent or gone. Arrow keys move it, plus and minus zoom, 0 shows all.`;
}

export default {
  components: { GroupMark },
  props: { frame: { type: Object, default: null }, chosen: { type: Array, default: () => [] } },
  emits: ["choose"],
  setup(props, { emit }) {
    const [canvas, followed] = [ref(null), ref("all")];
    const [view, motion, dark] = [new MapWindow(), new Motion(), onDark()];
    const still = matchMedia("(prefers-reduced-motion: reduce)");
    let drawn = 0;

    const { hovered, ...pointing } = usePointing(view, {
      robots: () => motion.now(performance.now()),
      moved: () => {
        followed.value = "none";
        wake();
      },
      zoomed: () => {
        if (followed.value === "all") followed.value = "none";
        wake();
      },
      home: () => (followed.value = "all"),
      choose: (name) => emit("choose", name),
    });
    const wake = usePainting(canvas, (now) => {
      const shown = motion.now(now);
      // Into the first picture nobody glides.
      const moving = follow(view, followed.value, shown, drawn < 2 || still.matches ? 1 : EASE);
      const how = { chosen: props.chosen, hovered: hovered.value, dark: dark.value };
      draw(contextOf(canvas.value, ...view.size), view, shown, props.frame?.edges ?? [], how);
      // Frames a second, for who measures: how often it was drawn.
      canvas.value.dataset.frames = ++drawn;
      if (moving || !motion.rests(now)) wake();
    }, () => (view.size = [canvas.value.clientWidth, canvas.value.clientHeight]));

    const mark = () => {
      if (canvas.value && props.frame) canvas.value.dataset.revision = props.frame.revision;
    };
    watch(() => props.frame, (frame) => {
      if (!frame) return;
      if (frame.past) motion.forget();
      motion.take(frame.robots, performance.now(), !still.matches && !frame.past);
      mark();
      wake();
    }, { immediate: true });
    watch([() => props.chosen, hovered, dark, followed], wake);
    onMounted(mark);

    const robots = computed(() => props.frame?.robots ?? []);
    const names = computed(() => robots.value.filter((robot) => robot.at).map((robot) => robot.id));
    const labels = computed(() => [...new Set(robots.value.map((robot) => robot.group).filter(Boolean))].sort(byLabel));
    const words = computed(() => inWords(robots.value, labels.value));
    return { canvas, hovered, followed, names, labels, words, ...pointing };
  },
  template: `
    <figure class="cv-map">
      <div class="cv-tools">
        <button @click="zoom(1.25)" aria-label="Zoom in">+</button>
        <button @click="zoom(0.8)" aria-label="Zoom out">−</button>
        <label>Follow <select v-model="followed">
          <option value="all">all</option><option value="none">nobody</option>
          <option v-for="name in names" :key="name" :value="name">{{ name }}</option></select></label>
      </div>
      <canvas ref="canvas" tabindex="0" role="img" :aria-label="words" @pointerdown="down" @pointermove="move" @pointerup="up"
        @pointercancel="up" @pointerleave="hovered = null" @wheel.prevent="wheel" @keydown="key"></canvas>
      <figcaption class="cv-legend">
        <group-mark v-for="label in labels" :key="label" :label="label"></group-mark>
        <span>filled: live</span><span>dashed: stale, silent for a while</span><span>crossed out: gone</span>
        <span>line: views in common, the thicker the more</span><span>ring, and line in full ink: chosen</span>
        <span>wedge: where it looks; its view goes on beyond</span><span>tail: its way of the last minute</span>
      </figcaption>
    </figure>`,
};
