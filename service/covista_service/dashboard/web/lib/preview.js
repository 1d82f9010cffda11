// What a proposal would make of the swarm: asked for when somebody changes it, and again as the swarm goes on.
import { ref, shallowRef, watch } from "vue";
import { asked, data, Lost, rest } from "covista/ask.js";
import { newest } from "covista/newest.js";
import { pulse } from "covista/pulse.js";
import { patchOf } from "covista/settings_words.js";

const EVERY_MS = 3000;
const QUIET_MS = 200;

const textOf = (changes) => JSON.stringify(patchOf(changes));
const preview = (body) => asked(rest("/groups/preview"), { method: "POST", body });

function wordsOf(error) {
  return error.status === 409 ? `These settings contradict each other: ${error.message}.` : `No preview now: ${error.message}.`;
}

// For `setup`. Groups as they are (`now`), as they would be (`then`), and as they would be made anew under the settings
// in force (`asIs`); the last two are null without changes. `soon` looks again, `outdate` says that settings were given;
// `heard` is told which start of the station answers, and the settings in force.
export function usePreview(proposal, heard) {
  const { changes } = proposal;
  const sections = shallowRef([]);
  const [now, then, asIs] = [shallowRef(null), shallowRef(null), shallowRef(null)];
  const operates = ref(null);
  const trouble = ref("");
  // Answers that were asked for before settings were given here are of the past.
  let given = 0;

  const readChoices = async () => {
    sections.value = (await asked(data("/choices"))).sections;
    proposal.read(sections.value.flatMap(({ settings }) => settings));
  };
  const look = async () => {
    const [turn, body] = [given, textOf(changes.value)];
    const moved = () => body !== textOf(changes.value);
    try {
      if (!sections.value.length) await readChoices();
      const [groups, session] = await Promise.all([asked(rest("/groups")), asked(data("/session"))]);
      if (turn !== given) return;
      operates.value = session.operates;
      heard(session.station, groups.settings);
      now.value = groups;
      proposal.take(groups.settings);
      if (moved()) return soon();
      const found = changes.value.length ? await Promise.all([preview(JSON.parse(body)), preview({})]) : [null, null];
      if (turn !== given || moved()) return soon();
      [then.value, asIs.value] = found;
      trouble.value = "";
    } catch (error) {
      if (error instanceof Lost) throw error;
      if (moved()) return soon();
      then.value = null;
      trouble.value = wordsOf(error);
    }
  };
  const looking = newest(look, QUIET_MS);
  const soon = () => looking.soon();
  pulse(looking.now, EVERY_MS);
  watch(changes, (next, before) => textOf(next) === textOf(before) || soon());
  return { sections, now, then, asIs, operates, trouble, soon, outdate: () => (given += 1) };
}
