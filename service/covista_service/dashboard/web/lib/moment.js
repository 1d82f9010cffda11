// The swarm at one time, now or in the past: the frame for the map. In the past the newest wish is answered last.
import { ref, shallowRef, watch } from "vue";
import { asked, data, heardOf } from "covista/ask.js";
import { pulse } from "covista/pulse.js";
import { edgesOf, robotsOf } from "covista/swarm_frames.js";

const NOW_MS = 1000;

// For `setup`. `time` is a ref: RFC 3339, or null for now.
export function useMoment(time) {
  const frame = shallowRef(null);
  const problem = ref("");
  let [asking, matrix, edges] = [false, -1, []];

  async function now() {
    if (time.value !== null) return;
    const found = await asked(data(`/swarm?matrix=${matrix}`));
    heardOf(found.station);
    if (found.edges) [edges, matrix] = [edgesOf(found.edges), found.matrix];
    if (time.value === null) frame.value = { ...found, robots: robotsOf(found.robots), edges, past: false };
  }

  async function then() {
    if (asking || time.value === null) return;
    asking = true;
    try {
      let wanted = null;
      while (time.value !== null && wanted !== time.value) {
        wanted = time.value;
        const found = await asked(data(`/past?time=${encodeURIComponent(wanted)}`));
        if (time.value !== null) frame.value = { ...found, robots: robotsOf(found.robots), edges: edgesOf(found.edges), past: true };
      }
      problem.value = "";
    } catch (error) {
      problem.value = error.message;
    } finally {
      asking = false;
    }
  }

  const beat = pulse(now, NOW_MS, (error) => {
    if (error) matrix = -1;
    if (time.value === null) problem.value = error ? error.message : "";
    // What could not be told is asked for again.
    else if (problem.value) then();
  });
  watch(time, () => (time.value === null ? beat() : then()), { immediate: true });
  return { frame, problem };
}
