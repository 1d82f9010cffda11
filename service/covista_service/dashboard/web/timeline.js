// What was: groups over time, what happened, and the swarm as it was at any time of it.
import { computed, ref, watch } from "vue";
import { page } from "covista/ask.js";
import EventList, { KINDS } from "covista/event_list.js";
import GroupBands from "covista/group_bands.js";
import GroupMark from "covista/group_mark.js";
import { ago, byLabel, byName } from "covista/looks.js";
import { useMoment } from "covista/moment.js";
import { length, msOf, spoken, zone } from "covista/moments.js";
import { usePast } from "covista/past_asking.js";
import SmallMatrix from "covista/small_matrix.js";
import SwarmMap from "covista/swarm_map.js";
import { addressOf, LONGEST_S, SHORTEST_S, useWindow } from "covista/timeline_window.js";

const SPANS = [[300, "5 min"], [3600, "1 h"], [21600, "6 h"], [86400, "24 h"], [604800, "7 d"]];
const REASONS = { no_pose: "had told no pose yet", gone: "was gone" };

function groupsOf(robots) {
  const found = new Map();
  for (const { id, group } of robots) {
    if (group) found.set(group, [...(found.get(group) ?? []), id]);
  }
  return [...found].sort(([a], [b]) => byLabel(a, b)).map(([label, members]) => ({ label, robots: members.sort(byName) }));
}

function emptyWords(frame, time) {
  if (!frame || frame.robots.length) return "";
  return time === null ? "No robot has been heard yet." : "Nothing is kept of that time: the station was not there yet, or it is too long ago.";
}

function clockWords(aheadMs) {
  if (Math.abs(aheadMs) < 5000) return "";
  return ` The station's clock is ${ago(Math.abs(aheadMs) / 1000)} ${aheadMs > 0 ? "ahead of" : "behind"} this one.`;
}

export default {
  components: { EventList, GroupBands, GroupMark, SmallMatrix, SwarmMap },
  setup() {
    const nowMs = () => Date.now() + past.aheadMs.value;
    const { settle, ...part } = useWindow(nowMs, () => past.bands.value?.until_ms ?? null);
    const { shown, untilMs } = part;
    const kinds = () => KINDS.filter((each) => shown.show.includes(each.name)).flatMap((each) => each.kinds);
    const past = usePast(() => ({ spanMs: 1000 * shown.span, untilMs: untilMs.value }), kinds);
    watch([shown, untilMs], past.beat);
    watch(past.bands, settle, { once: true });
    const { frame, problem: unseen } = useMoment(computed(() => shown.time));

    const robots = computed(() => frame.value?.robots ?? []);
    const groups = computed(() => groupsOf(robots.value));
    const missing = computed(() => robots.value.filter((robot) => !robot.group));
    const heading = computed(() => (shown.time === null ? "Now" : spoken(msOf(shown.time), nowMs())));
    const empty = computed(() => emptyWords(frame.value, shown.time));
    const unheard = computed(() => frame.value?.past && robots.value.length && robots.value.every((robot) => !robot.at));
    const otherClock = computed(() => clockWords(past.aheadMs.value));
    const linkOf = (to) => addressOf({ ...shown, time: to });
    const chosen = ref([]);
    const choose = (name) => (chosen.value = chosen.value.includes(name) ? [] : [name]);
    return {
      SPANS, REASONS, LONGEST_S, SHORTEST_S, ...part, ...past, frame, unseen, groups, missing, heading, empty, unheard, linkOf, otherClock, chosen, choose,
      page, spoken, length, zone,
    };
  },
  template: `
    <div class="cv-timeline">
      <p v-if="strange" class="cv-problem" role="alert">{{ strange }}</p>
      <div class="cv-timeline-bar">
        <div role="group" aria-label="How long" class="cv-pick">
          <button v-for="[seconds, words] in SPANS" :key="seconds" :aria-pressed="shown.span === seconds" @click="spanned(seconds)">{{ words }}</button>
        </div>
        <div role="group" aria-label="Which part" class="cv-pick">
          <button aria-label="Zoom time in" :disabled="shown.span <= SHORTEST_S" @click="spanned(shown.span / 2)">+</button>
          <button aria-label="Zoom time out" :disabled="shown.span >= LONGEST_S" @click="spanned(shown.span * 2)">−</button>
          <button @click="shift(-0.5)">Earlier</button>
          <button :disabled="untilMs === null" @click="shift(0.5)">Later</button>
        </div>
        <span class="cv-soft">{{ length(shown.span) }} are shown</span>
        <button class="cv-to-now" :class="{ 'cv-main-action': untilMs !== null }" :aria-pressed="untilMs === null" @click="live">Live</button>
      </div>
      <p v-if="problem" class="cv-problem" role="alert">The past cannot be shown now: {{ problem }}. Trying again.</p>
      <p v-if="!bands && !problem">Asking the station.</p>
      <template v-if="bands">
        <p v-if="!bands.robots.length">No groups are kept of this time: choose a longer one, or another.</p>
        <group-bands :bands="bands" :events="events.items" :time="shown.time" @scrub="scrub"></group-bands>
        <p class="cv-soft">Times are in {{ zone(bands.until_ms) }}.{{ otherClock }}
          <template v-if="bands.thinned">So long a time is thinned: groups are looked at now and then, and short changes between are not drawn. Zoom in to see all.</template></p>
        <ul v-if="bands.gaps.length" class="cv-list"><li v-for="gap in bands.gaps" :key="gap.since_ms + gap.reason">
          <span>Hatched: from {{ spoken(gap.since_ms) }} to {{ spoken(gap.until_ms) }} something is missing: {{ gap.reason }}.</span></li></ul>
      </template>
      <div class="cv-timeline-then">
        <section class="cv-card" aria-labelledby="cv-then">
          <h2 id="cv-then">{{ heading }} <button v-if="shown.time !== null" @click="live">Back to now</button></h2>
          <p v-if="unseen" class="cv-problem" role="alert">That time cannot be shown now: {{ unseen }}. Trying again.</p>
          <p v-if="empty">{{ empty }}</p>
          <p v-if="unheard">No robot was heard in the minutes before: where they were is not known, and the station may not have run.</p>
          <ul class="cv-list cv-then-groups">
            <li v-for="group in groups" :key="group.label"><group-mark :label="group.label"></group-mark>
              <span><template v-for="(robot, k) in group.robots" :key="robot"><template v-if="k">, </template><a :href="page('/robots/' + robot)">{{ robot }}</a></template></span></li>
            <li v-for="robot in missing" :key="robot.id"><group-mark :label="null"></group-mark>
              <span><a :href="page('/robots/' + robot.id)">{{ robot.id }}</a> {{ REASONS[robot.reason] ?? 'stood in no group yet' }}</span></li>
          </ul>
          <small-matrix :frame="frame"></small-matrix>
        </section>
        <swarm-map :key="shown.time === null" :frame="frame" :chosen="chosen" @choose="choose"></swarm-map>
        <event-list v-if="bands" :events="events" :since-ms="bands.since_ms" :time="shown.time" :chosen="shown.show" :link-of="linkOf" @scrub="scrub"
          @choose="shown.show = $event"></event-list>
      </div>
    </div>`,
};
