// One robot: what it sees, with whom it shares that, and what becomes of what it sends.
import { computed, reactive, ref, shallowRef } from "vue";
import { asked, data, heardOf, page, rest } from "covista/ask.js";
import EventList, { KINDS } from "covista/event_list.js";
import GroupMark from "covista/group_mark.js";
import { msOf, spoken } from "covista/moments.js";
import Neighbours from "covista/neighbours.js";
import { newestEvents } from "covista/past_asking.js";
import { pulse } from "covista/pulse.js";
import RobotAccounts from "covista/robot_accounts.js";
import { Samples } from "covista/samples.js";

const [EVERY_MS, EVENTS_MS, FORGOTTEN_MS, SOON_MS] = [1000, 5000, 5000, 100];
const WEEK_MS = 604800000;
const MOST_EVENTS = 100;
const IS_ID = /^[a-z0-9][a-z0-9_-]{0,62}$/;
// Less in common is none to speak of.
const LEAST = 0.01;
const GROUPED = ["join", "moved", "split", "merge"];
const SHOWN = KINDS.filter((each) => each.name !== "Settings");

export default {
  components: { EventList, GroupMark, Neighbours, RobotAccounts },
  props: { robot: { type: String, required: true } },
  setup(props) {
    document.title = `${props.robot} - Covista`;
    const valid = IS_ID.test(props.robot);
    const [words, report, pairs] = [shallowRef(null), shallowRef(null), shallowRef(null)];
    const [problem, unread] = [ref(""), ref("")];
    const rates = reactive({ keyframes: null, poses: null, missing: null });
    const counted = new Samples();
    const aheadMs = ref(0);

    async function look() {
      const found = await asked(data(`/robots/${props.robot}/words`));
      heardOf(found.station);
      words.value = found;
      // By the station's clock.
      aheadMs.value = msOf(found.time) - Date.now();
      if (!found.known) {
        report.value = pairs.value = null;
        return;
      }
      [report.value, { pairs: pairs.value }] = await Promise.all([
        asked(rest(`/robots/${props.robot}`)),
        asked(rest(`/pairs?robot=${props.robot}&min_overlap=${LEAST}`)),
      ]);
      const { keyframes, poses } = report.value;
      const sent = { keyframes: keyframes.received, poses: poses.received, missing: keyframes.missing + poses.missing };
      counted.take({ station: found.station, ...sent }, performance.now());
      for (const name of Object.keys(rates)) {
        const aMinute = counted.rate((answer) => answer[name]);
        rates[name] = aMinute === null ? null : aMinute / 60;
      }
    }

    const events = shallowRef(null);
    const chosen = ref(["Robots", "Warnings"]);
    let askedUntil = null;
    async function recall() {
      if (!words.value) return;
      const now = Date.now() + aheadMs.value;
      const since = askedUntil === null ? now - WEEK_MS : askedUntil - 5000;
      const which = { kinds: SHOWN.flatMap((each) => each.kinds), robot: props.robot };
      const found = await newestEvents(since, now + 1000, which, MOST_EVENTS);
      const known = events.value?.items ?? [];
      const seen = new Set(known.map((event) => event.id));
      const items = [...known, ...found.items.filter((event) => !seen.has(event.id))].slice(-MOST_EVENTS);
      events.value = { items, reachesMs: askedUntil === null ? found.reachesMs : events.value.reachesMs };
      askedUntil = now;
    }
    if (valid) {
      pulse(look, () => (words.value?.known === false ? FORGOTTEN_MS : EVERY_MS), (error) => (problem.value = error ? error.message : ""));
      pulse(recall, () => (words.value ? EVENTS_MS : SOON_MS), (error) => (unread.value = error ? error.message : ""));
    }

    const shown = computed(() => {
      const kinds = SHOWN.filter((each) => chosen.value.includes(each.name)).flatMap((each) => each.kinds);
      return { ...events.value, items: (events.value?.items ?? []).filter((event) => kinds.includes(event.event)) };
    });
    const grouped = computed(() => {
      const group = report.value?.group;
      return group ? events.value?.items.findLast((event) => GROUPED.includes(event.event) && event.labels.includes(group)) : undefined;
    });
    const linkOf = (time) => page(`/timeline?time=${encodeURIComponent(time)}`);
    const camera = computed(() => {
      const told = report.value?.camera;
      if (!told) return "It has told none yet.";
      const degrees = (px, f) => Math.round((360 / Math.PI) * Math.atan(px / 2 / f));
      const lens = { none: "no distortion", plumb_bob: "a plumb-bob lens", equidistant: "a fisheye lens" }[told.distortion.model];
      return `${told.width} x ${told.height} pixels, some ${degrees(told.width, told.fx)} x ${degrees(told.height, told.fy)} degrees, ${lens}.`;
    });
    const place = computed(() => {
      const at = report.value?.pose?.position_m;
      return at ? `x ${at[0].toFixed(2)} m, y ${at[1].toFixed(2)} m, z ${at[2].toFixed(2)} m` : "not told yet";
    });
    const shows = computed(() => Boolean(words.value?.known && report.value));
    const picture = computed(() => {
      const key = words.value?.picture?.key;
      return key ? data(`/robots/${props.robot}/view.png?keyframe=${encodeURIComponent(key)}`) : null;
    });
    const sinceMs = computed(() => Date.now() + aheadMs.value - WEEK_MS);
    return { shows, valid, words, report, pairs, problem, unread, rates, events, shown, chosen, SHOWN, grouped, linkOf, camera, place, picture, sinceMs, page, msOf, spoken };
  },
  template: `
    <div class="cv-robot-page">
      <p v-if="!valid" class="cv-problem" role="alert">{{ robot }} is no id of a robot: one has small letters, digits, _ and -, such as r1. <a :href="page('/')">The swarm</a></p>
      <p v-else-if="problem && !words" class="cv-problem" role="alert">{{ problem }}. Trying again.</p>
      <p v-else-if="!words">Asking the station.</p>
      <p v-else-if="problem" class="cv-problem" role="alert">What you see is from before: {{ problem }}. Trying again.</p>
      <p v-if="words && !words.known" class="cv-card" role="status"><b>No robot {{ robot }} is known now.</b> It has not come since the station started, or was silent
        for so long that it is forgotten. When it sends something, it is shown here. <a :href="page('/')">The swarm</a></p>
      <section v-if="shows" class="cv-card cv-robot-head" :class="'cv-is-' + report.status" aria-labelledby="cv-robot-id">
        <h2 id="cv-robot-id">{{ robot }} <group-mark :label="report.group"></group-mark></h2>
        <p v-for="sentence in words.standing" :key="sentence">{{ sentence }}</p>
        <p v-if="grouped">It came to {{ report.group }} at <a :href="linkOf(grouped.time)">{{ spoken(msOf(grouped.time)) }}</a>: {{ grouped.text }}.</p>
      </section>
      <div :class="{ 'cv-robot-columns': shows }">
        <div v-if="shows">
          <section class="cv-card" aria-labelledby="cv-view">
            <h2 id="cv-view">What it sees</h2>
            <img v-if="picture" class="cv-view" :src="picture" :alt="'The newest keyframe of ' + robot">
            <p v-else class="cv-no-view">{{ words.picture.words }}</p>
            <p v-if="picture" class="cv-soft">{{ words.picture.words }}
              <template v-if="report.keyframe">Number {{ report.keyframe.sequence }} since the robot started.</template></p>
          </section>
          <robot-accounts :report="report" :dropped="words.dropped" :rates="rates"></robot-accounts>
        </div>
        <div>
          <neighbours v-if="shows" :robot="robot" :pairs="pairs"></neighbours>
          <section v-if="shows" class="cv-card" aria-labelledby="cv-about">
            <h2 id="cv-about">Clock, pose, camera</h2>
            <dl class="cv-facts">
              <dt>Clock</dt><dd>{{ words.clock }}</dd>
              <dt>Pose</dt><dd>{{ words.pose }}</dd>
              <dt>Place</dt><dd>{{ place }}</dd>
              <dt>Camera</dt><dd>{{ camera }}</dd>
              <dt>Boot</dt><dd class="cv-long">{{ report.boot ?? 'not told yet' }}</dd>
              <dt>Last heard</dt><dd>{{ report.last_seen ? spoken(msOf(report.last_seen)) : 'never' }}</dd>
            </dl>
          </section>
          <p v-if="valid && unread" class="cv-problem" role="alert">Its past cannot be shown now: {{ unread }}. Trying again.</p>
          <event-list v-if="events" heading="When it came and went" within="in the last 7 days" :kinds="SHOWN" :events="shown" :since-ms="sinceMs"
            :chosen="chosen" :link-of="linkOf" away @choose="chosen = $event"></event-list>
        </div>
      </div>
    </div>`,
};
