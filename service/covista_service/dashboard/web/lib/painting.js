// A canvas that is painted anew when something has changed, once a frame of the screen at most.
import { onMounted, onUnmounted } from "vue";

// For `setup`. `element` is a ref of what gives the canvas its size, the canvas itself or what it lies in; `resized` hears
// that it has another. What is given back asks for a painting.
export function usePainting(element, paint, resized = () => {}) {
  let asked = null;
  const painted = (now) => {
    asked = null;
    if (element.value) paint(now);
  };
  const wake = () => {
    asked ??= requestAnimationFrame(painted);
  };
  const observer = new ResizeObserver(() => {
    resized();
    wake();
  });
  onMounted(() => {
    // What is there to be drawn at once is not to be drawn in no size.
    resized();
    observer.observe(element.value);
  });
  onUnmounted(() => {
    observer.disconnect();
    cancelAnimationFrame(asked);
  });
  return wake;
}

// The context of a canvas so wide and high in px of the page, in which lengths are such px too.
export function contextOf(canvas, width, height) {
  const ratio = globalThis.devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  // A canvas that is given its own size again is wiped.
  if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}
