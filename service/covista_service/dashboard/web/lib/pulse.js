// Does something again and again while somebody looks: a hidden page asks nothing, and a slow answer is waited for.
import { onMounted, onUnmounted } from "vue";
import { standing } from "covista/ask.js";

const LOST_MS = 1000;

// To be called in `setup`. `everyMs` is a number or a function that gives one; trouble goes to `failed`.
export function pulse(work, everyMs, failed = () => {}) {
  let timer = null;
  let over = false;
  let running = false;

  async function beat() {
    clearTimeout(timer);
    if (over || running || document.hidden || standing.loggedOut) return;
    running = true;
    let pause = typeof everyMs === "function" ? everyMs() : everyMs;
    try {
      await work();
      failed(null);
    } catch (error) {
      failed(error);
      pause = Math.max(pause, LOST_MS);
    } finally {
      running = false;
    }
    if (!over) timer = setTimeout(beat, pause);
  }

  onMounted(() => {
    document.addEventListener("visibilitychange", beat);
    beat();
  });
  onUnmounted(() => {
    over = true;
    clearTimeout(timer);
    document.removeEventListener("visibilitychange", beat);
  });
  return beat;
}
