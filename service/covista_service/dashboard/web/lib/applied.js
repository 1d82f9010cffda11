// What was applied in this tab and can be taken back. It outlives the page, which loads itself anew after a restart.
import { computed, ref } from "vue";
import { root } from "covista/ask.js";
import { spoken } from "covista/moments.js";
import { flat, same, says } from "covista/settings_words.js";

// Another station may stand below another path of this host.
const KEPT = `covista-applied${root}`;

const listed = (changes) => changes.map(says).join("; ");

// What stands otherwise now than it was applied, as changes.
export const overtakenIn = (asking, live) =>
  asking.filter(({ name, value }) => !same(live[name], value)).map(({ name, value }) => ({ name, value: live[name], was: value }));

// Those of what was applied, the newest last, that undoing one after the other would find as they were applied.
function undoable(done, live) {
  const found = { ...live };
  const from = done.findLastIndex(({ asking }) => {
    if (overtakenIn(asking, found).length) return true;
    for (const { name, was } of asking) found[name] = was;
    return false;
  });
  return done.slice(from + 1);
}

function wordOf(done, kept, live, station) {
  const { at, asking, start } = done.at(-1);
  if (!kept.length) {
    return `What was applied here at ${spoken(at)} cannot be undone here any more, for it stands otherwise now: ${listed(overtakenIn(asking, live))}.`;
  }
  return `Applied at ${spoken(at)}${start === station ? "" : ", before the station restarted"}: ${listed(asking)}.`;
}

// For `setup`: `done` is what can be taken back, the newest last; `word` says what came of the last.
export function useApplied() {
  const done = ref([]);
  const word = ref("");
  // Which start of the station answers; null before it has.
  let station = null;

  const keep = () => {
    if (done.value.length) sessionStorage.setItem(KEPT, JSON.stringify(done.value));
    else sessionStorage.removeItem(KEPT);
  };
  // The station has answered: what this tab had applied before the page was loaded can be undone if it still stands.
  const recall = (start, settings) => {
    const first = station === null;
    station = start;
    const before = first ? JSON.parse(sessionStorage.getItem(KEPT) ?? "[]") : [];
    if (!before.length) return;
    const live = flat(settings);
    done.value = undoable(before, live);
    word.value = wordOf(before, done.value, live, station);
    keep();
  };
  const applied = (asking) => {
    const at = Date.now();
    done.value.push({ at, start: station, asking });
    word.value = `Applied at ${spoken(at)}: ${listed(asking)}.`;
    keep();
  };
  const undone = (asking) => {
    done.value.pop();
    word.value = asking.length ? `Undone at ${spoken(Date.now())}: ${listed(asking)}.` : "Somebody else has undone it already.";
    keep();
  };
  const last = computed(() => done.value.at(-1)?.asking ?? []);
  return { done, word, last, recall, applied, undone };
}
