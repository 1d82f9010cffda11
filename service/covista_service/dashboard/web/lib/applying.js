// Gives the station the settings that were tried, once somebody has said yes, and takes them back.
import { computed, nextTick, ref } from "vue";
import { overtakenIn } from "covista/applied.js";
import { asked, Lost, rest } from "covista/ask.js";
import { patchOf, same } from "covista/settings_words.js";

// Sends changes, one after the other; `told` is the element that says so and is gone to then, `closed` is done in any case.
function useSending(proposal, { operates, outdate, soon }, closed) {
  const busy = ref(false);
  const applyTrouble = ref("");
  const told = ref(null);
  const send = async (asking, after) => {
    busy.value = true;
    applyTrouble.value = "";
    let went = false;
    try {
      const settings = await asked(rest("/settings"), { method: "PATCH", body: patchOf(asking) });
      outdate();
      proposal.given(settings, asking);
      after();
      went = true;
    } catch (error) {
      if (error.status === 403) operates.value = false;
      applyTrouble.value = `Nothing was changed: ${error.message}.`;
      if (error instanceof Lost) applyTrouble.value = "No answer came: look below whether the settings are in force.";
    } finally {
      busy.value = false;
      closed();
      soon();
      // What was pressed is gone, or cannot be pressed again.
      await nextTick();
      if (went) told.value?.focus();
    }
  };
  return { busy, applyTrouble, told, send };
}

// For `setup`. `preview` is what usePreview gives, `applied` what useApplied does.
export function useApplying(proposal, preview, applied) {
  const { live, changes } = proposal;
  // Questions that stand open.
  const [applying, undoing] = [ref(false), ref(false)];
  const { busy, applyTrouble, told, send } = useSending(proposal, preview, () => {
    applying.value = undoing.value = false;
  });

  const apply = () => {
    const asking = changes.value.map(({ name, value, was }) => ({ name, value, was }));
    return send(asking, () => {
      applied.applied(asking);
      proposal.reset();
    });
  };
  // What others have made of it meanwhile.
  const overtaken = computed(() => overtakenIn(applied.last.value, live.value));
  const back = computed(() => applied.last.value
    .map(({ name, was }) => ({ name, value: was, was: live.value[name] }))
    .filter(({ value, was }) => !same(value, was)));
  const undo = () => {
    const asking = back.value;
    return send(asking, () => applied.undone(asking));
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
  return { applying, undoing, busy, applyTrouble, told, apply, undo, askUndo, overtaken, back };
}
