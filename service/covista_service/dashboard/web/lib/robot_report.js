// What the station tells of one robot, asked for again and again, and how much it sends now.
import { reactive, ref, shallowRef } from "vue";
import { asked, data, heardOf, rest } from "covista/ask.js";
import { msOf } from "covista/moments.js";
import { pulse } from "covista/pulse.js";
import { Samples } from "covista/samples.js";

const [EVERY_MS, FORGOTTEN_MS] = [1000, 5000];
// Less in common is none to speak of.
const LEAST = 0.01;
// Robots send some messages a second: of less than this their number is chance.
const LEAST_MS = 4000;

// For `setup`. `known` is whether `robot` can be one at all; only then anything is asked. Gives `words`, `report` and
// `pairs` (null before they are there), messages a second, how far the station's clock is ahead, and why there is no answer.
export function useRobotReport(robot, known) {
  const [words, report, pairs] = [shallowRef(null), shallowRef(null), shallowRef(null)];
  const problem = ref("");
  const aheadMs = ref(0);
  const { rates, count } = useRates();

  async function look() {
    const found = await asked(data(`/robots/${robot}/words`));
    heardOf(found.station);
    words.value = found;
    // By the station's clock.
    aheadMs.value = msOf(found.time) - Date.now();
    if (!found.known) {
      report.value = pairs.value = null;
      return;
    }
    [report.value, { pairs: pairs.value }] = await Promise.all([
      asked(rest(`/robots/${robot}`)),
      asked(rest(`/pairs?robot=${robot}&min_overlap=${LEAST}`)),
    ]);
    count(found.station, report.value);
  }
  if (known) {
    pulse(look, () => (words.value?.known === false ? FORGOTTEN_MS : EVERY_MS), (error) => (problem.value = error ? error.message : ""));
  }
  return { words, report, pairs, rates, aheadMs, problem };
}

// Messages a second; null before enough was watched.
function useRates() {
  const rates = reactive({ keyframes: null, poses: null, missing: null });
  const counted = new Samples();
  const count = (station, { keyframes, poses }) => {
    const sent = { keyframes: keyframes.received, poses: poses.received, missing: keyframes.missing + poses.missing };
    counted.take({ station, ...sent }, performance.now());
    for (const name of Object.keys(rates)) {
      const aMinute = counted.rate((answer) => answer[name], LEAST_MS);
      rates[name] = aMinute === null ? null : aMinute / 60;
    }
  };
  return { rates, count };
}
