// What somebody should look at now, of what the station says and of what is growing while one watches.
const SLOW_MS = 500;
const SLOW_SHARE = 0.05;
const BUSY_SHARE = 0.9;
// Rates are judged after so long: one drop in the first two seconds would be thirty a minute, and an alarm.
export const LEAST_MS = 20000;
const ORDER = { bad: 0, warn: 1, note: 2 };

export const rounded = (rate) => (rate === null ? "..." : rate > 0 && rate < 10 ? rate.toFixed(1) : `${Math.round(rate)}`);

const totalOf = (key) => (answer) => answer.counts.find((each) => each.key === key)?.total;

// Counts with how many a minute come now, those that need somebody first, then those with most; not by rates, for rows
// that change places with each answer cannot be read, and lose who stands on a link in them.
export function countsNow(answer, samples) {
  return answer.counts
    .map((each) => ({ ...each, rate: samples.rate(totalOf(each.key), LEAST_MS) }))
    .map((each) => ({ ...each, grave: each.bearable !== null && (each.rate ?? 0) > each.bearable }))
    .sort((a, b) => b.grave - a.grave || b.total - a.total);
}

function latencyNeeds(samples) {
  if (!samples.spans(LEAST_MS)) return [];
  const read = (name) => (answer) => answer.latency[name];
  const found = [];
  const mean = samples.ratio(read("sum_s"), read("count"));
  const slow = samples.ratio(read("slow"), read("count"));
  if (mean !== null && (1000 * mean > SLOW_MS || slow > SLOW_SHARE)) {
    found.push({
      key: "late", level: "warn", robots: [],
      says: `Groups come late: ${Math.round(1000 * mean)} ms after a keyframe on average, ${Math.round(100 * slow)} % of them later than half a second.`,
      todo: "More comes than the station can take: have robots send less often, or give it more workers.",
    });
  }
  const busy = samples.rate((answer) => answer.turns_s, LEAST_MS);
  if (busy !== null && busy / 60 > BUSY_SHARE) {
    found.push({ key: "busy", level: "warn", robots: [], says: "The main loop has no rest: too many messages or robots.", todo: "Have robots send less often." });
  }
  return found;
}

// Each has a `key` that stays while what it says changes.
export function needsNow(answer, counts, samples) {
  const growing = counts.filter(({ grave }) => grave).map((each) => ({
    key: each.key,
    level: "warn",
    says: `${each.about} (${each.reason}): ${rounded(each.rate)} a minute now. ${each.means}`,
    todo: each.todo,
    robots: each.robots.map(([robot]) => robot),
  }));
  return [...answer.attention, ...growing, ...latencyNeeds(samples)].sort((a, b) => ORDER[a.level] - ORDER[b.level]);
}

// What is said aloud when it changes, so without numbers that change all the time.
export function headline(answer, needs, samples) {
  const serious = needs.filter(({ level }) => level !== "note").length;
  if (answer.status !== "ready") return answer.sentence;
  if (serious) return `${answer.sentence} ${serious === 1 ? "One thing needs" : `${serious} things need`} attention.`;
  if (!samples.spans(LEAST_MS)) return `${answer.sentence} Whether anything is being dropped is known after ${LEAST_MS / 1000} s.`;
  return "All is well: every part of the station works, and nothing is being dropped.";
}

// By what colour it is said; "open" as long as not all is known.
export function moodOf(answer, needs, samples) {
  const levels = needs.map(({ level }) => level);
  if (levels.includes("bad") || answer.status === "stopping") return "bad";
  if (levels.includes("warn") || answer.status !== "ready") return "warn";
  return samples.spans(LEAST_MS) ? "good" : "open";
}
