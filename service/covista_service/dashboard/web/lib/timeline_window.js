// Which time a page of the past looks at, and which part of time is drawn around it; kept in its address.
import { reactive, ref, watch } from "vue";
import { write } from "covista/address.js";
import { page } from "covista/ask.js";
import { KINDS } from "covista/event_list.js";
import { msOf, spoken } from "covista/moments.js";

export const [SHORTEST_S, LONGEST_S] = [10, 2592000];
const USUAL = { span: 300, show: ["Groups", "Robots"] };
const NO_TIME = "The time in the address is none, so this is now. One looks like 2026-05-04T12:30:15Z.";

// What the address says: ?time=2026-05-04T12:30:15Z&span=3600&show=Groups,Robots
function fromAddress() {
  const query = new URLSearchParams(location.search);
  const [time, span, show] = ["time", "span", "show"].map((name) => query.get(name));
  const seconds = Number(span);
  const valid = time !== null && Number.isFinite(msOf(time));
  return {
    time: valid ? (/[zZ]|[+-]\d\d:\d\d$/.test(time) ? time : new Date(msOf(time)).toISOString()) : null,
    span: seconds >= SHORTEST_S && seconds <= LONGEST_S ? seconds : USUAL.span,
    show: show === null ? USUAL.show : KINDS.map((each) => each.name).filter((name) => show.split(",").includes(name)),
    wrong: time !== null && !valid,
  };
}

export function addressOf({ time, span, show }) {
  const query = new URLSearchParams();
  if (time !== null) query.set("time", time);
  if (span !== USUAL.span) query.set("span", span);
  if (show.join() !== USUAL.show.join()) query.set("show", show.join());
  return page(`/timeline${query.size ? `?${query}` : ""}`);
}

// For `setup`. `nowMs` gives the station's now, `bandsEnd` where what is drawn ends, null before anything is.
// `shown` has time (null is now), span in seconds and what is listed; `untilMs` is where the part ends, null with now.
export function useWindow(nowMs, bandsEnd) {
  const { wrong, ...begun } = fromAddress();
  const shown = reactive(begun);
  const strange = ref(wrong ? NO_TIME : "");
  const untilMs = ref(shown.time === null ? null : msOf(shown.time) + 500 * shown.span);

  const around = (ms) => (untilMs.value = Math.min(nowMs(), ms + 500 * shown.span));
  const scrub = (to) => {
    strange.value = "";
    // Who looks at the past wants it to stand still.
    if (untilMs.value === null) untilMs.value = bandsEnd() ?? nowMs();
    shown.time = to;
    if (msOf(to) < untilMs.value - 1000 * shown.span || msOf(to) > untilMs.value) around(msOf(to));
  };
  const live = () => {
    strange.value = "";
    shown.time = untilMs.value = null;
  };
  const spanned = (seconds) => {
    shown.span = Math.round(Math.min(LONGEST_S, Math.max(SHORTEST_S, seconds)));
    if (shown.time !== null) around(msOf(shown.time));
    else if (untilMs.value !== null) untilMs.value = Math.min(nowMs(), untilMs.value);
  };
  const shift = (share) => {
    const to = (untilMs.value ?? nowMs()) + share * 1000 * shown.span;
    // Nearly now is now, and goes on.
    untilMs.value = to >= nowMs() - 50 * shown.span && shown.time === null ? null : Math.min(nowMs(), to);
  };
  // Once the station's clock is known: what is still to come cannot be looked at.
  const settle = () => {
    if (untilMs.value !== null) untilMs.value = Math.min(nowMs(), untilMs.value);
    if (shown.time === null || msOf(shown.time) <= nowMs()) return;
    const time = spoken(msOf(shown.time));
    live();
    strange.value = `${time} is still to come, so this is now.`;
  };
  watch(shown, () => write(addressOf(shown)));
  return { shown, strange, untilMs, scrub, live, spanned, shift, settle };
}
