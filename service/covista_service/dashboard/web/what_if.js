// What other settings would make of the swarm, beside what is; nothing changes until somebody applies it.
import { computed, nextTick, ref, shallowRef, watch } from "vue";
import { asked, data, Lost, rest } from "covista/ask.js";
import { newest } from "covista/newest.js";
import { useProposal } from "covista/proposal.js";
import { pulse } from "covista/pulse.js";
import { patchOf, same, says } from "covista/settings_words.js";
import ConfirmBox from "covista/confirm_box.js";
import ScoreLines from "covista/score_lines.js";
import SettingField from "covista/setting_field.js";
import WouldBe, { movers } from "covista/would_be.js";

const EVERY_MS = 3000;
const QUIET_MS = 200;
const MOST_NAMED = 8;

const named = (robots) => {
  const first = robots.slice(0, MOST_NAMED).join(", ");
  return robots.length > MOST_NAMED ? `${first} and ${robots.length - MOST_NAMED} more` : first;
};
const number = (count) => `${count} ${count === 1 ? "group" : "groups"}`;

export default {
  components: { ConfirmBox, ScoreLines, SettingField, WouldBe },
  setup() {
    const sections = shallowRef([]);
    const proposal = useProposal();
    const { live, changes } = proposal;
    const [now, then, asIs] = [shallowRef(null), shallowRef(null), shallowRef(null)];
    const operates = ref(null);
    const [trouble, applyTrouble] = [ref(""), ref("")];
    // Answers that were asked for before settings were given here are of the past.
    let given = 0;

    const bodyOf = () => JSON.stringify(patchOf(changes.value));
    const preview = (body) => asked(rest("/groups/preview"), { method: "POST", body });
    const look = async () => {
      const [turn, body] = [given, bodyOf()];
      try {
        if (!sections.value.length) {
          sections.value = (await asked(data("/choices"))).sections;
          proposal.read(sections.value.flatMap(({ settings }) => settings));
        }
        const [groups, session] = await Promise.all([asked(rest("/groups")), asked(data("/session"))]);
        if (turn !== given) return;
        operates.value = session.operates;
        now.value = groups;
        proposal.take(groups.settings);
        if (body !== bodyOf()) return again();
        const found = changes.value.length ? await Promise.all([preview(JSON.parse(body)), preview({})]) : [null, null];
        if (turn !== given || body !== bodyOf()) return again();
        [then.value, asIs.value] = found;
        trouble.value = "";
      } catch (error) {
        if (error instanceof Lost) throw error;
        if (body !== bodyOf()) return again();
        then.value = null;
        trouble.value = error.status === 409 ? `These settings contradict each other: ${error.message}.` : `No preview now: ${error.message}.`;
      }
    };
    const looking = newest(look, QUIET_MS);
    const again = () => looking.soon();
    pulse(looking.now, EVERY_MS);
    watch(changes, (next, before) => {
      if (JSON.stringify(patchOf(next)) !== JSON.stringify(patchOf(before))) looking.soon();
    });

    const moved = computed(() => (now.value && then.value ? movers(now.value, then.value) : []));
    const summary = computed(() => {
      if (!now.value || !changes.value.length) return "";
      if (!then.value) return trouble.value ? "" : "Asking the station.";
      const [before, after] = [now.value.groups.length, then.value.groups.length];
      const much = before === after ? `Still ${number(after)}` : `${number(after)} instead of ${before}`;
      if (!moved.value.length) return `${much}: nobody would move.`;
      const names = moved.value.map(({ robot }) => robot);
      return names.length > MOST_NAMED ? `${much}: ${names.length} robots would move.` : `${much}: ${named(names)} would move.`;
    });
    // Who would move as settings are, if nothing held on to the groups on show.
    const anyway = computed(() => {
      if (!asIs.value || !then.value) return [];
      const alike = new Map(movers(now.value, asIs.value).map(({ robot, to }) => [robot, to]));
      return moved.value.filter(({ robot, to }) => alike.get(robot) === to).map(({ robot }) => robot);
    });
    const unseen = computed(() => changes.value.filter(({ choice, value, was }) =>
      !choice.shown && !(choice.name === "hysteresis.smoothing" && (value === 1 || was === 1))).map(({ name }) => name));
    const robots = computed(() => (now.value ? now.value.groups.reduce((sum, group) => sum + group.robots.length, 0) : 0));

    const [applying, undoing, busy] = [ref(false), ref(false), ref(false)];
    // Newest last: what was applied here, and can be taken back.
    const done = ref([]);
    const word = ref("");
    const told = ref(null);
    const send = async (asking, after) => {
      busy.value = true;
      applyTrouble.value = "";
      let went = false;
      try {
        const settings = await asked(rest("/settings"), { method: "PATCH", body: patchOf(asking) });
        given += 1;
        proposal.given(settings, asking);
        after();
        went = true;
      } catch (error) {
        if (error.status === 403) operates.value = false;
        applyTrouble.value = `Nothing was changed: ${error.message}.`;
        if (error instanceof Lost) applyTrouble.value = "No answer came: look below whether the settings are in force.";
      } finally {
        [busy.value, applying.value, undoing.value] = [false, false, false];
        looking.soon();
        // What was pressed is gone, or cannot be pressed again.
        await nextTick();
        if (went) told.value?.focus();
      }
    };
    const clock = () => new Date().toLocaleTimeString();
    const apply = () => {
      const asking = changes.value.map(({ name, value, was }) => ({ name, value, was }));
      return send(asking, () => {
        done.value.push(asking);
        word.value = `Applied at ${clock()}: ${asking.map(says).join("; ")}.`;
        proposal.reset();
      });
    };
    const last = computed(() => done.value.at(-1) ?? []);
    // What others have made of it meanwhile.
    const overtaken = computed(() => last.value.filter(({ name, value }) => !same(live.value[name], value)));
    const back = computed(() => last.value
      .map(({ name, was }) => ({ name, value: was, was: live.value[name] }))
      .filter(({ value, was }) => !same(value, was)));
    const undo = () => {
      const asking = back.value;
      return send(asking, () => {
        done.value.pop();
        word.value = asking.length ? `Undone at ${clock()}: ${asking.map(says).join("; ")}.` : "Somebody else has undone it already.";
      });
    };
    const askUndo = async () => {
      if (busy.value) return;
      busy.value = true;
      // Others may have changed them since the last look.
      try {
        proposal.take(await asked(rest("/settings")));
      } catch (error) {
        applyTrouble.value = `Nothing was changed: ${error.message}.`;
        return;
      } finally {
        busy.value = false;
      }
      if (overtaken.value.length) undoing.value = true;
      else await undo();
    };
    return {
      ...proposal, sections, now, then, asIs, operates, trouble, applyTrouble, summary, anyway, unseen, robots, named, says, same,
      applying, undoing, busy, done, word, told, apply, undo, askUndo, overtaken, back,
    };
  },
  template: `
    <p v-if="!live" :class="trouble ? 'cv-problem' : 'cv-soft'" role="status">{{ trouble || "Asking the station." }}</p>
    <div v-else class="cv-what-if">
      <form class="cv-panel" aria-label="Settings to try" @submit.prevent>
        <p v-if="unread.length" class="cv-problem" role="status">The address names what is no setting, or no value of one; it was left out: {{ unread.join(", ") }}</p>
        <section v-for="section in sections" :key="section.title">
          <h2>{{ section.title }}</h2>
          <setting-field v-for="choice in section.settings" :key="choice.name" :choice="choice" :value="valueOf(choice.name)"
            :was="live[choice.name]" :robots="robots" @change="set(choice.name, $event)"></setting-field>
        </section>
      </form>
      <div class="cv-panel cv-outcome">
        <section class="cv-verdict" aria-labelledby="cv-verdict">
          <h2 id="cv-verdict">{{ changes.length ? "What would be" : "What is" }}</h2>
          <p v-if="others.length" class="cv-alarm" role="status">Somebody else has changed settings: {{ others.map(says).join("; ") }}.
            <button type="button" @click="noted">Seen</button></p>
          <p v-if="word" ref="told" class="cv-done" role="status" tabindex="-1">{{ word }}
            <button v-if="done.length" type="button" :disabled="busy || !operates" @click="askUndo">Undo</button></p>
          <p v-if="applyTrouble" class="cv-problem" role="alert">{{ applyTrouble }}</p>
          <p v-if="trouble" class="cv-problem" role="alert">{{ trouble }}</p>
          <p v-if="!changes.length">Try other settings: the groups that would be appear here. Nothing changes until you apply it.</p>
          <template v-else>
            <p class="cv-summary" aria-live="polite">{{ summary }}</p>
            <p v-if="then?.note" class="cv-note">{{ then.note }}</p>
            <p v-if="anyway.length" class="cv-soft">Of these, {{ named(anyway) }} would move with the settings as they are too, if nothing held on to the groups that stand.</p>
            <p v-if="unseen.length" class="cv-soft">No preview can show {{ unseen.join(" and ") }}: that acts over time.</p>
            <p class="cv-soft">{{ changes.map(says).join("; ") }}</p>
          </template>
          <p class="cv-pick cv-actions">
            <button type="button" class="cv-main-action" :disabled="!changes.length || !operates || busy" :aria-describedby="operates ? null : 'cv-why-not'"
              @click="applying = true">Apply ...</button>
            <button type="button" :disabled="!changes.length" @click="reset()">Back to what is</button>
          </p>
          <p v-if="operates === false" id="cv-why-not" class="cv-soft">You may look and try, and not apply: that needs a token of scope operate. Hand on the address of this page to somebody who has one.</p>
        </section>
        <section aria-labelledby="cv-beside">
          <h2 id="cv-beside">Groups</h2>
          <p v-if="!robots">No robot stands in a group.</p>
          <would-be v-else :now="now" :then="then"></would-be>
          <p v-if="now.note" class="cv-note">Now: {{ now.note }}</p>
        </section>
        <section aria-labelledby="cv-scores">
          <h2 id="cv-scores">Why so many: the score of every number of groups</h2>
          <score-lines :now="asIs ?? now" :then="then"></score-lines>
        </section>
      </div>
      <confirm-box :open="applying" title="Apply these settings?" action="Apply" :busy="busy" @confirm="apply" @close="applying = false">
        <ul><li v-for="change in changes" :key="change.name">{{ says(change) }}</li></ul>
        <p v-if="summary">{{ summary }}</p>
        <p>They hold at once for everybody, and after a restart too. You can undo it here as long as this page is open.</p>
      </confirm-box>
      <confirm-box :open="undoing" title="Somebody else has changed them since" action="Undo all the same" :busy="busy" @confirm="undo" @close="undoing = false">
        <p>Since you applied yours: {{ overtaken.map(({ name, value }) => says({ name, value: live[name], was: value })).join("; ") }}. To undo now means:</p>
        <ul><li v-for="change in back" :key="change.name">{{ says(change) }}</li></ul>
      </confirm-box>
    </div>`,
};
