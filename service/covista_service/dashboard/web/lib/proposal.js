// Settings that somebody tries, beside those in force. They stand in the address, so that they can be handed on.
import { computed, reactive, ref, shallowRef, watch } from "vue";
import { write } from "covista/address.js";
import { differing, flat, fromAddress, same, toAddress } from "covista/settings_words.js";

// What an address names, as `wanted` values by name, and as words what it names that is none.
function readFrom(query, choices) {
  const [wanted, unread] = [{}, []];
  for (const [name, text] of new URLSearchParams(query)) {
    const choice = choices.find((each) => each.name === name);
    const value = choice && fromAddress(choice, text);
    if (value === undefined) unread.push(`${name}=${text}`);
    else wanted[name] = value;
  }
  return { wanted, unread };
}

function writeTo(address, changes) {
  const query = changes.map(({ name, value }) => `${name}=${encodeURIComponent(toAddress(value))}`).join("&");
  write(address.pathname + (query ? `?${query}` : "") + address.hash);
}

const changesIn = (choices, wanted, live) =>
  choices
    .filter(({ name }) => name in wanted && !same(wanted[name], live[name]))
    .map((choice) => ({ name: choice.name, choice, value: wanted[choice.name], was: live[choice.name] }));

// For `setup`.
export function useProposal() {
  const choices = shallowRef([]);
  const live = shallowRef(null);
  // In force when somebody last looked at what others change.
  const seen = shallowRef(null);
  const wanted = reactive({});
  // What the address names and is no setting, or no value of one.
  const unread = ref([]);

  const changes = computed(() => (live.value ? changesIn(choices.value, wanted, live.value) : []));
  const others = computed(() => (live.value ? differing(seen.value, live.value) : []));

  const valueOf = (name) => (name in wanted ? wanted[name] : live.value[name]);
  const set = (name, value) => {
    if (same(value, live.value[name])) delete wanted[name];
    else wanted[name] = value;
  };
  const reset = (name) => {
    for (const each of name ? [name] : Object.keys(wanted)) delete wanted[each];
  };
  const noted = () => (seen.value = live.value);

  // Settings came from the station.
  const take = (settings) => {
    const now = flat(settings);
    if (live.value && !differing(live.value, now).length) return;
    live.value = now;
    seen.value ??= now;
  };
  // They are those that somebody has just given here: nothing to be told of.
  const given = (settings, changed) => {
    seen.value = { ...seen.value, ...Object.fromEntries(changed.map(({ name, value }) => [name, value])) };
    take(settings);
  };

  const read = (known) => {
    choices.value = known;
    const found = readFrom(location.search, known);
    Object.assign(wanted, found.wanted);
    unread.value.push(...found.unread);
  };
  watch([changes, choices], ([now]) => {
    if (!live.value || !choices.value.length) return;
    writeTo(location, now);
  });
  return { choices, live, changes, others, unread, valueOf, set, reset, noted, take, given, read };
}
