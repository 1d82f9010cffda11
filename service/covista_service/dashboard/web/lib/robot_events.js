// When a robot came and went, and what else befell it: events of the last days, newer ones joined to them.
import { computed, ref, shallowRef } from "vue";
import { KINDS } from "covista/event_list.js";
import { newestEvents } from "covista/past_asking.js";
import { pulse } from "covista/pulse.js";

const [EVERY_MS, SOON_MS] = [5000, 100];
// An event is told a little after its time.
const AGAIN_MS = 5000;
const WEEK_MS = 604800000;
const MOST = 100;
const GROUPED = ["join", "moved", "split", "merge"];
// Those that are of robots.
export const SHOWN = KINDS.filter((each) => each.name !== "Settings");
const kindsOf = (shown) => shown.flatMap((each) => each.kinds);

// For `setup`, with what `useRobotReport` gives; what is asked for waits for its first answer, which has the station's
// time. Gives all `events` (null before they are there) and those `shown` by what is `chosen`.
export function useRobotEvents(robot, known, { words, report, aheadMs }) {
  const events = shallowRef(null);
  const unread = ref("");
  const chosen = ref(["Robots", "Warnings"]);
  let askedUntil = null;

  async function recall() {
    if (!words.value) return;
    const now = Date.now() + aheadMs.value;
    const since = askedUntil === null ? now - WEEK_MS : askedUntil - AGAIN_MS;
    const found = await newestEvents(since, now + 1000, { kinds: kindsOf(SHOWN), robot }, MOST);
    const before = events.value?.items ?? [];
    const seen = new Set(before.map((event) => event.id));
    const items = [...before, ...found.items.filter((event) => !seen.has(event.id))].slice(-MOST);
    events.value = { items, reachesMs: askedUntil === null ? found.reachesMs : events.value.reachesMs };
    askedUntil = now;
  }
  if (known) {
    pulse(recall, () => (words.value ? EVERY_MS : SOON_MS), (error) => (unread.value = error ? error.message : ""));
  }

  const shown = computed(() => {
    const kinds = kindsOf(SHOWN.filter((each) => chosen.value.includes(each.name)));
    return { ...events.value, items: (events.value?.items ?? []).filter((event) => kinds.includes(event.event)) };
  });
  // How it came to the group that it stands in.
  const grouped = computed(() => {
    const group = report.value?.group;
    return group ? events.value?.items.findLast((event) => GROUPED.includes(event.event) && event.labels.includes(group)) : undefined;
  });
  const sinceMs = computed(() => Date.now() + aheadMs.value - WEEK_MS);
  return { events, shown, chosen, grouped, sinceMs, unread };
}
