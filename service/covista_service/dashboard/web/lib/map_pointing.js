// How a map is moved by pointers and keys, and which robot is pointed at.
import { ref } from "vue";

const NEAR_PX = 14;
const STEP_PX = 60;
const DRAGGED_PX = 4;

const placeOf = (event) => [event.offsetX, event.offsetY];

// For `setup`. `robots` gives what is shown now, [{ robot, at }]; `moved` hears that somebody has moved the window by hand,
// `zoomed` that it shows more or less, `home` that all are to be seen again, `choose` of a robot that was clicked.
export function usePointing(view, { robots, moved, zoomed, home, choose }) {
  const hovered = ref(null);
  const pointers = new Map();
  let dragged = false;

  const nearest = ([x, y]) => {
    let [found, least] = [null, NEAR_PX];
    for (const { robot, at } of robots()) {
      if (!at) continue;
      const [u, v] = view.px(at);
      const distance = Math.hypot(u - x, v - y);
      if (distance < least) [found, least] = [robot.id, distance];
    }
    return found;
  };
  const down = (event) => {
    event.currentTarget.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, placeOf(event));
    dragged = false;
  };
  const pinch = (id, from, to) => {
    const [other] = [...pointers].filter(([each]) => each !== id).map(([, at]) => at);
    const spread = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
    view.zoom(spread(to) / spread(from), other);
  };
  const move = (event) => {
    const [from, to] = [pointers.get(event.pointerId), placeOf(event)];
    if (!from) {
      hovered.value = nearest(to);
      return;
    }
    if (pointers.size === 2) pinch(event.pointerId, from, to);
    else if (dragged || Math.hypot(to[0] - from[0], to[1] - from[1]) > DRAGGED_PX) view.pan(to[0] - from[0], to[1] - from[1]);
    else return;
    dragged = true;
    pointers.set(event.pointerId, to);
    moved();
  };
  const up = (event) => {
    pointers.delete(event.pointerId);
    const found = nearest(placeOf(event));
    if (!dragged && found && event.type === "pointerup") choose(found);
  };
  const zoom = (factor, at) => {
    view.zoom(factor, at);
    zoomed();
  };
  const wheel = (event) => zoom(Math.exp(-0.0015 * event.deltaY), placeOf(event));
  return { hovered, down, move, up, wheel, zoom, key: keysOf(view, { zoom, moved, home }) };
}

const STEPS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const ZOOMS = { "+": 1.25, "=": 1.25, "-": 0.8 };

function keysOf(view, { zoom, moved, home }) {
  return (event) => {
    // With these they are the browser's: back, forward, larger letters.
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (STEPS[event.key]) {
      const [dx, dy] = STEPS[event.key];
      view.pan(dx * STEP_PX, dy * STEP_PX);
      moved();
    } else if (ZOOMS[event.key]) zoom(ZOOMS[event.key]);
    else if (event.key === "0") home();
    else return;
    event.preventDefault();
  };
}
