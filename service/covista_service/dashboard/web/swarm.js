// The swarm in one look: the map, the groups, and why two robots are apart or together.
import { computed, ref, watch } from "vue";
import { choose as writeChosen, chosenIn } from "covista/address.js";
import { asked, data, page } from "covista/ask.js";
import { ago, byLabel, byName, REASONS, silence } from "covista/looks.js";
import { pulse } from "covista/pulse.js";
import { useSwarm } from "covista/swarm_frames.js";
import GroupMark from "covista/group_mark.js";
import SwarmMap from "covista/swarm_map.js";

const WHY_MS = 1000;

export default {
  components: { GroupMark, SwarmMap },
  setup() {
    const { frame } = useSwarm();
    const robots = computed(() => (frame.value ? frame.value.robots : []));
    const groups = computed(() => {
      const found = new Map();
      for (const robot of robots.value) {
        if (!robot.group) continue;
        if (!found.has(robot.group)) found.set(robot.group, []);
        found.get(robot.group).push(robot);
      }
      return [...found].sort(([a], [b]) => byLabel(a, b)).map(([label, members]) => ({ label, members }));
    });
    const missing = computed(() => robots.value.filter((robot) => !robot.group));
    const quiet = computed(() => robots.value.filter((robot) => robot.group && robot.status !== "live"));
    const names = computed(() => robots.value.map((robot) => robot.id).sort(byName));

    const chosen = ref(["a", "b"].map(chosenIn).filter(Boolean));
    watch(chosen, ([a, b]) => writeChosen({ a, b }));
    const choose = (name) => {
      if (chosen.value.includes(name)) chosen.value = chosen.value.filter((each) => each !== name);
      else chosen.value = [...chosen.value, name].slice(-2);
    };
    // Who is forgotten is not chosen any more.
    watch(names, (known) => {
      if (chosen.value.some((name) => !known.includes(name))) chosen.value = chosen.value.filter((name) => known.includes(name));
    });
    const pair = computed(() => {
      const [a, b] = chosen.value;
      return { a: a ?? names.value[0], b: b ?? names.value.find((name) => name !== (a ?? names.value[0])) };
    });
    const pick = (side, name) => {
      const { a, b } = pair.value;
      chosen.value = side === "a" ? [name, b === name ? a : b] : [a === name ? b : a, name];
    };
    const why = ref(null);
    const ask = pulse(async () => {
      const { a, b } = pair.value;
      why.value = a && b ? await asked(data(`/why?a=${a}&b=${b}`)) : null;
    }, WHY_MS);
    return { frame, robots, groups, missing, quiet, names, chosen, choose, pair, pick, why, ask, page, ago, silence, REASONS };
  },
  watch: {
    pair() {
      this.ask();
    },
  },
  template: `
    <div class="cv-swarm">
      <swarm-map :frame="frame" :chosen="chosen" @choose="choose"></swarm-map>
      <aside class="cv-panel">
        <section aria-labelledby="cv-groups">
          <h2 id="cv-groups">Groups</h2>
          <p v-if="!frame">Asking the station.</p>
          <p v-else-if="!robots.length">No robot has been heard yet.</p>
          <ul class="cv-list">
            <li v-for="group in groups" :key="group.label">
              <group-mark :label="group.label"></group-mark>
              <span class="cv-members">
                <button v-for="robot in group.members" :key="robot.id" class="cv-robot" :class="'cv-' + robot.status"
                  :aria-pressed="chosen.includes(robot.id)" @click="choose(robot.id)">{{ robot.id }}</button>
              </span>
            </li>
          </ul>
        </section>
        <section v-if="robots.length" aria-labelledby="cv-missing">
          <h2 id="cv-missing">Missing</h2>
          <p v-if="!missing.length && !quiet.length">Nobody: {{ robots.length === 1 ? 'the only robot is' : 'all ' + robots.length + ' robots are' }} live and in a group.</p>
          <ul v-else class="cv-list">
            <li v-for="robot in missing" :key="robot.id">
              <button class="cv-robot" :class="'cv-' + robot.status" :aria-pressed="chosen.includes(robot.id)"
                @click="choose(robot.id)">{{ robot.id }}</button>
              <span>{{ REASONS[robot.reason] ?? 'is in no group yet' }}; {{ robot.silentS === null ? 'never heard' : 'last heard ' + ago(robot.silentS) + ' ago' }}</span>
            </li>
            <li v-for="robot in quiet" :key="robot.id">
              <button class="cv-robot" :class="'cv-' + robot.status" :aria-pressed="chosen.includes(robot.id)"
                @click="choose(robot.id)">{{ robot.id }}</button>
              <span>{{ silence(robot.status, robot.silentS) }}, still in {{ robot.group }}</span>
            </li>
          </ul>
        </section>
        <section v-if="pair.b" aria-labelledby="cv-why">
          <h2 id="cv-why">Why?</h2>
          <p class="cv-pick">
            <label>Robot <select :value="pair.a" @change="pick('a', $event.target.value)">
              <option v-for="name in names" :key="name">{{ name }}</option></select></label>
            <label>and <select :value="pair.b" @change="pick('b', $event.target.value)">
              <option v-for="name in names" :key="name">{{ name }}</option></select></label>
          </p>
          <p v-if="why?.problem">The station says: {{ why.problem }}.</p>
          <p v-for="(sentence, k) in why?.sentences" :key="k">{{ sentence }}</p>
          <p class="cv-note">Similarity is 1 for robots that see the same from the same place, and 0 for those that share nothing and
            stand far apart.</p>
          <p><a :href="page('/pairs/' + pair.a + '/' + pair.b)">What both see</a>,
            <a :href="page('/robots/' + pair.a)">{{ pair.a }}</a>, <a :href="page('/robots/' + pair.b)">{{ pair.b }}</a></p>
        </section>
      </aside>
    </div>`,
};
