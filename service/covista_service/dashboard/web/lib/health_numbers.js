// Numbers of the station as tables show them: as they are, and how they went while one watches.
import { LEAST_MS } from "covista/health_needs.js";

const FATES = [
  ["received", "came"], ["used", "used"], ["replaced", "overtaken by newer"], ["duplicate", "came twice"],
  ["dropped", "dropped"], ["waiting", "undecided"], ["missing", "never came"],
];

// What became of messages: a row for each fate, in it a cell for each topic.
export function fatesNow(answer, samples) {
  const cell = (account, fate) => {
    const read = (each) => each.fates.find(({ topic }) => topic === account.topic)?.[fate];
    return { topic: account.topic, total: account[fate], rate: samples.rate(read, LEAST_MS) };
  };
  return FATES.map(([fate, title]) => ({ fate, title, cells: answer.fates.map((account) => cell(account, fate)) }));
}

export function waitingNow(answer, samples) {
  const valueOf = (key) => (each) => each.waiting.find((queue) => queue.key === key)?.value;
  return answer.waiting.map((each) => ({ ...each, past: samples.values(valueOf(each.key)) }));
}

// From a keyframe to groups, in milliseconds.
export function latencyNow(answer, samples) {
  const [sum, count] = [(each) => each.latency.sum_s, (each) => each.latency.count];
  const mean = samples.ratio(sum, count);
  const past = samples.ratios(sum, count).map((value) => (value === null ? null : 1000 * value));
  const known = past.filter((value) => value !== null);
  return { ...answer.latency, mean_ms: mean === null ? null : 1000 * mean, judged: samples.spans(LEAST_MS), past, highest: known.length ? Math.max(...known) : null };
}
