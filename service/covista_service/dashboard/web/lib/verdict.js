// What a preview comes to, in words.
import { computed } from "vue";
import { counted } from "covista/looks.js";
import { movers } from "covista/would_be.js";

const MOST_NAMED = 8;

export const named = (robots) => {
  const first = robots.slice(0, MOST_NAMED).join(", ");
  return robots.length > MOST_NAMED ? `${first} and ${robots.length - MOST_NAMED} more` : first;
};
const number = (count) => counted(count, "group");

function summed(now, then, moved) {
  const [before, after] = [now.groups.length, then.groups.length];
  const much = before === after ? `Still ${number(after)}` : `${number(after)} instead of ${before}`;
  if (!moved.length) return `${much}: nobody would move.`;
  const names = moved.map(({ robot }) => robot);
  return names.length > MOST_NAMED ? `${much}: ${names.length} robots would move.` : `${much}: ${named(names)} would move.`;
}

// What acts over time alone, where one moment is looked at.
const actsOverTime = ({ choice, value, was }) =>
  !choice.shown && !(choice.name === "hysteresis.smoothing" && (value === 1 || was === 1));

// For `setup`; of the preview's `now`, `then`, `asIs` and `trouble`.
export function useVerdict({ now, then, asIs, trouble }, changes) {
  const moved = computed(() => (now.value && then.value ? movers(now.value, then.value) : []));
  const summary = computed(() => {
    if (!now.value || !changes.value.length) return "";
    if (!then.value) return trouble.value ? "" : "Asking the station.";
    return summed(now.value, then.value, moved.value);
  });
  // Who would move as settings are, if nothing held on to the groups on show.
  const anyway = computed(() => {
    if (!asIs.value || !then.value) return [];
    const alike = new Map(movers(now.value, asIs.value).map(({ robot, to }) => [robot, to]));
    return moved.value.filter(({ robot, to }) => alike.get(robot) === to).map(({ robot }) => robot);
  });
  const unseen = computed(() => changes.value.filter(actsOverTime).map(({ name }) => name));
  const robots = computed(() => (now.value ? now.value.groups.reduce((sum, group) => sum + group.robots.length, 0) : 0));
  return { summary, anyway, unseen, robots };
}
