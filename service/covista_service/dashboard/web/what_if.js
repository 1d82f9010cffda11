// What other settings would make of the swarm, beside what is; nothing changes until somebody applies it.
import { useApplied } from "covista/applied.js";
import { useApplying } from "covista/applying.js";
import { usePreview } from "covista/preview.js";
import { useProposal } from "covista/proposal.js";
import { says } from "covista/settings_words.js";
import { named, useVerdict } from "covista/verdict.js";
import ConfirmBox from "covista/confirm_box.js";
import ScoreLines from "covista/score_lines.js";
import SettingField from "covista/setting_field.js";
import WouldBe from "covista/would_be.js";

export default {
  components: { ConfirmBox, ScoreLines, SettingField, WouldBe },
  setup() {
    const proposal = useProposal();
    const applied = useApplied();
    const preview = usePreview(proposal, applied.recall);
    return {
      ...proposal, ...preview, ...applied, ...useVerdict(preview, proposal.changes), ...useApplying(proposal, preview, applied), named, says,
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
          <p v-if="!changes.length">Move a slider or choose another value: the groups that would be are shown here, beside those that are. Nothing changes until you press Apply.</p>
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
        <p>They hold at once for everybody, and after a restart too. You can undo this here until you close the tab; if somebody else changes them meanwhile, you are asked first.</p>
      </confirm-box>
      <confirm-box :open="undoing" title="Somebody else has changed them since" action="Undo all the same" :busy="busy" @confirm="undo" @close="undoing = false">
        <p>Since you applied yours: {{ overtaken.map(says).join("; ") }}. To undo now means:</p>
        <ul><li v-for="change in back" :key="change.name">{{ says(change) }}</li></ul>
      </confirm-box>
    </div>`,
};
