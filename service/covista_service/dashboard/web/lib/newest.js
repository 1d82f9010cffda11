// Does something for the newest state of affairs: when that has been quiet for a moment, and once at a time.
import { onUnmounted } from "vue";

// To be called in `setup`. `now` does it at once, or once more after what is under way; `soon` after a pause, and what
// goes wrong then is for who does it `now` again and again.
export function newest(work, quietMs) {
  let timer = null;
  let running = null;
  let again = false;

  async function round() {
    do {
      again = false;
      await work();
    } while (again);
  }
  const now = () => {
    clearTimeout(timer);
    again = true;
    running ??= round().finally(() => (running = null));
    return running;
  };
  const soon = () => {
    clearTimeout(timer);
    timer = setTimeout(() => now().catch(() => {}), quietMs);
  };
  onUnmounted(() => clearTimeout(timer));
  return { now, soon };
}
