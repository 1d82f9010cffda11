// What somebody should look at now, of what the station says and of what is growing while one watches.
const SLOW_MS = 500;
const SLOW_SHARE = 0.05;
const BUSY_SHARE = 0.9;
const ORDER = { bad: 0, warn: 1, note: 2 };

export const rounded = (rate) => (rate === null ? "..." : rate > 0 && rate < 10 ? rate.toFixed(1) : `${Math.round(rate)}`);

export const totalOf = (key) => (answer) => answer.counts.find((each) => each.key === key)?.total;

// Counts with how many a minute come now, those that need somebody first, then those with most.
export function countsNow(answer, samples) {
  return answer.counts
    .map((each) => ({ ...each, rate: samples.rate(totalOf(each.key)) }))
    .map((each) => ({ ...each, grave: each.bearable !== null && (each.rate ?? 0) > each.bearable }))
    .sort((a, b) => b.grave - a.grave || (b.rate ?? 0) - (a.rate ?? 0) || b.total - a.total);
}

function latencyNeeds(samples) {
  const read = (name) => (answer) => answer.latency[name];
  const found = [];
  const mean = samples.ratio(read("sum_s"), read("count"));
  const slow = samples.ratio(read("slow"), read("count"));
  if (mean !== null && (1000 * mean > SLOW_MS || slow > SLOW_SHARE)) {
    found.push({
      level: "warn", robots: [],
      says: `Groups come late: ${Math.round(1000 * mean)} ms after a keyframe on average, ${Math.round(100 * slow)} % of them later than half a second.`,
      todo: "More comes than the station can take: have robots send less often, or give it more workers.",
    });
  }
  const busy = samples.rate((answer) => answer.turns_s);
  if (busy !== null && busy / 60 > BUSY_SHARE) {
    found.push({ level: "warn", robots: [], says: "The main loop has no rest: too many messages or robots.", todo: "Have robots send less often." });
  }
  return found;
}

export function needsNow(answer, counts, samples) {
  const growing = counts.filter(({ grave }) => grave).map((each) => ({
    level: "warn",
    says: `${each.about} (${each.reason}): ${rounded(each.rate)} a minute now. ${each.means}`,
    todo: each.todo,
    robots: each.robots.map(([robot]) => robot),
  }));
  return [...answer.attention, ...growing, ...latencyNeeds(samples)].sort((a, b) => ORDER[a.level] - ORDER[b.level]);
}

export function headline(answer, needs) {
  const serious = needs.filter(({ level }) => level !== "note").length;
  if (answer.status !== "ready") return answer.sentence;
  if (serious) return `${answer.sentence} ${serious === 1 ? "One thing needs" : `${serious} things need`} attention.`;
  return "All is well: every part of the station works, and nothing is being dropped.";
}
