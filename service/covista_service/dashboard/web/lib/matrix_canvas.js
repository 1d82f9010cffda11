// Draws a matrix on a canvas as large as there is room for, anew when there is something new to see.
import { ref, watch } from "vue";
import { onDark } from "covista/dark.js";
import { cellUnder, drawChosen, drawMatrix, layoutOf, sideOf } from "covista/matrix_drawing.js";
import { usePainting } from "covista/painting.js";

const LEAST_PX = 240;
const BELOW_PX = 265;

const colour = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
const ratioNow = () => globalThis.devicePixelRatio || 1;
const themeOf = (dark) => ({ dark, ink: colour("--cv-ink"), paper: colour("--cv-card"), soft: colour("--cv-soft") });

// All but the pair that is looked at: what to copy from, and the layout of it.
function groundOf(matrix, width, height, looks) {
  const ground = new OffscreenCanvas(width, height);
  const pen = ground.getContext("2d");
  const layout = layoutOf(matrix.order.length, width / looks.ratio, matrix.robots, matrix.blocks);
  pen.scale(looks.ratio, looks.ratio);
  if (matrix.order.length) drawMatrix(pen, layout, matrix, looks);
  return { ground, layout };
}

function compose(context, { ground, layout }, at, looks) {
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, ground.width, ground.height);
  context.drawImage(ground, 0, 0);
  context.setTransform(looks.ratio, 0, 0, looks.ratio, 0, 0);
  if (at) drawChosen(context, layout, at, looks);
}

// How long a canvas for the matrix may be, in its own pixels.
function lengthOf(matrix, width) {
  const side = Math.max(LEAST_PX, Math.min(width, globalThis.innerHeight - BELOW_PX));
  const fits = sideOf(matrix?.order.length ?? 0, Math.min(width, side), matrix?.robots ?? [], matrix?.blocks ?? []);
  return Math.round(fits * ratioNow());
}

// For `setup`: refs for the canvas and for the room that it has. `matrix` and `looked` are functions that give what is
// to be drawn, and the row and column that are looked at or null.
export function useCanvas(matrix, looked) {
  const [canvas, room] = [ref(null), ref(null)];
  const dark = onDark();
  // Drawn once for each matrix.
  let drawing = null;
  let drawn = 0;

  const paint = () => {
    const context = canvas.value?.getContext("2d");
    if (!context || !matrix() || !room.value.clientWidth) return;
    const { width, height } = canvas.value;
    const looks = { ...themeOf(dark.value), ratio: ratioNow() };
    drawing = drawing?.ground ? drawing : groundOf(matrix(), width, height, looks);
    compose(context, drawing, looked(), looks);
    canvas.value.dataset.drawn = ++drawn;
  };
  const anew = () => {
    // Until it is drawn, people point at the layout that they see.
    if (drawing) drawing = { ...drawing, ground: null };
    wake();
  };
  const resize = () => {
    const width = room.value.clientWidth;
    // Hidden as long as there is nothing to show.
    if (!width) return;
    const length = lengthOf(matrix(), width);
    if (canvas.value.width === length) return;
    canvas.value.width = canvas.value.height = length;
    canvas.value.style.width = canvas.value.style.height = `${length / ratioNow()}px`;
    anew();
  };
  const wake = usePainting(room, paint, resize);
  watch(dark, anew);
  const under = (event) => {
    if (!drawing || !matrix()) return null;
    const box = canvas.value.getBoundingClientRect();
    return cellUnder(drawing.layout, [event.clientX - box.left, event.clientY - box.top]);
  };
  return { canvas, room, wake, anew, resize, under };
}
