// One robot: what it sees, with whom it shares that, and what becomes of what it sends.
import { computed } from "vue";
import { data, page } from "covista/ask.js";
import EventList from "covista/event_list.js";
import GroupMark from "covista/group_mark.js";
import { msOf, spoken } from "covista/moments.js";
import Neighbours from "covista/neighbours.js";
import { isId } from "covista/pair_facts.js";
import RobotAccounts from "covista/robot_accounts.js";
import { SHOWN, useRobotEvents } from "covista/robot_events.js";
import { cameraWords, placeWords } from "covista/robot_facts.js";
import { useRobotReport } from "covista/robot_report.js";

export default {
  components: { EventList, GroupMark, Neighbours, RobotAccounts },
  props: { robot: { type: String, required: true } },
  setup(props) {
    document.title = `${props.robot} - Covista`;
    const valid = isId(props.robot);
    const told = useRobotReport(props.robot, valid);
    const past = useRobotEvents(props.robot, valid, told);
    const { words, report } = told;

    const shows = computed(() => Boolean(words.value?.known && report.value));
    const camera = computed(() => cameraWords(report.value?.camera));
    const place = computed(() => placeWords(report.value?.pose));
    const picture = computed(() => {
      const key = words.value?.picture?.key;
      return key ? data(`/robots/${props.robot}/view.png?keyframe=${encodeURIComponent(key)}`) : null;
    });
    const linkOf = (time) => page(`/timeline?time=${encodeURIComponent(time)}`);
    return { ...told, ...past, valid, shows, camera, place, picture, linkOf, SHOWN, page, msOf, spoken };
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
        <p v-for="(sentence, k) in words.standing" :key="k">{{ sentence }}</p>
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
          <neighbours v-if="shows" :robot="robot" :pairs="pairs" :silent="words.silent"></neighbours>
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
