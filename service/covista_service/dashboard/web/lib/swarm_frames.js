// The swarm, asked for twice a second; less often where it is large. Frames come as columns and leave here as robots.
import { shallowRef } from "vue";
import { asked, data, heardOf } from "covista/ask.js";
import { pulse, toTop } from "covista/pulse.js";

const EVERY_MS = 400;
const MANY = 300;
const MANY_MS = 1000;

export function robotsOf(columns) {
  return columns.id.map((id, k) => ({
    id,
    status: columns.status[k],
    group: columns.group[k],
    reason: columns.reason[k],
    at: columns.at_m[k],
    view: columns.view[k],
    silentS: columns.silent_s[k],
    offDeg: columns.off_deg[k],
  }));
}

export function edgesOf(edges) {
  return edges.pairs.map(([i, j, ofFirst, ofSecond]) => ({ a: edges.robots[i], b: edges.robots[j], ofFirst, ofSecond }));
}

// For `setup`: the newest frame, { time, revision, matrix, robots, edges }, null before the first.
export function useSwarm() {
  const frame = shallowRef(null);
  let edges = [];
  let matrix = -1;
  const tell = toTop();
  const beat = pulse(
    async () => {
      const found = await asked(data(`/swarm?matrix=${matrix}`));
      if (found.station !== frame.value?.station) heardOf(found.station);
      if (found.edges) {
        edges = edgesOf(found.edges);
        matrix = found.matrix;
      }
      frame.value = { ...found, robots: robotsOf(found.robots), edges };
    },
    () => (frame.value && frame.value.robots.length > MANY ? MANY_MS : EVERY_MS),
    (error) => {
      tell(error);
      // Another station's revisions say nothing of what is shown.
      if (error) matrix = -1;
    },
  );
  return { frame, beat };
}
