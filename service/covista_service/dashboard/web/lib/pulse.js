// Does something again and again while somebody looks: a hidden page asks nothing, and a slow answer is waited for.
import { onMounted, onUnmounted, watch } from "vue";
import { standing } from "covista/ask.js";

const LOST_MS = 1000;

// To be called in `setup`. `everyMs` is a number or a function that gives one; trouble goes to `failed`, or else to the
// top of the page. What is given back does it at once, or once more after what is under way.
export function pulse(work, everyMs, failed = toTop()) {
  let timer = null;
  let over = false;
  let running = false;
  let again = false;

  async function beat() {
    clearTimeout(timer);
    again = running;
    if (over || running || document.hidden || standing.loggedOut) return;
    running = true;
    let least = 0;
    try {
      await work();
      failed(null);
    } catch (error) {
      failed(error);
      least = LOST_MS;
    } finally {
      running = false;
    }
    if (over) return;
    const pause = again ? 0 : typeof everyMs === "function" ? everyMs() : everyMs;
    timer = setTimeout(beat, Math.max(pause, least));
  }

  // Who has logged in again goes on.
  watch(() => standing.loggedOut, (out) => out || beat());
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

// For `failed`, to be called in `setup`: trouble is told at the top of the page as long as it lasts.
export function toTop() {
  const mine = Symbol("asking");
  onUnmounted(() => standing.troubles.delete(mine));
  return (error) => {
    if (error) standing.troubles.set(mine, error.message);
    else standing.troubles.delete(mine);
  };
}
