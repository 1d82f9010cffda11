// At the top of every page: whether the station answers, light or dark, and the way out.
import { computed, onMounted, onUnmounted, ref, watch } from "vue";
import { asked, data, heardOf, noteRestart, page, root, standing } from "covista/ask.js";
import { onDark } from "covista/dark.js";
import { clock } from "covista/moments.js";
import { pulse } from "covista/pulse.js";

const DARK = "covista-dark";
const EVERY_MS = 2000;
// What is asked here takes no time: without an answer the station hangs.
const HANGS_MS = 4000;
const OUT_MS = 10000;

// The form to log in, which leads back to what is shown here.
const logIn = () => page(`/log-in?next=${encodeURIComponent(location.pathname.slice(`${root}/dashboard`.length) + location.search)}`);

export default {
  setup() {
    const session = ref(null);
    const look = async () => {
      session.value = await asked(data("/session"), { timeoutMs: HANGS_MS });
      heardOf(session.value.station);
    };
    pulse(look, EVERY_MS, () => {});
    // Somebody may log in again on another page.
    const outside = setInterval(() => {
      if (standing.loggedOut && !document.hidden) look().then(() => (standing.loggedOut = false), () => {});
    }, OUT_MS);
    onUnmounted(() => clearInterval(outside));
    const kept = localStorage.getItem(DARK);
    onMounted(() => {
      if (kept !== null) Quasar.Dark.set(kept === "true");
    });
    const dark = onDark();
    const turn = () => {
      const wanted = !dark.value;
      Quasar.Dark.set(wanted);
      localStorage.setItem(DARK, wanted);
    };
    // Nothing is let in any more that this page would try again and again.
    watch(() => standing.loggedOut, (out) => (out ? globalThis.socket?.disconnect() : globalThis.socket?.connect()));
    const words = computed(() => {
      if (standing.loggedOut) return "You are not logged in any more: you have logged out, your token is revoked, or the station has restarted.";
      if (standing.lostSince !== null) {
        return `The station has not answered since ${clock(standing.lostSince)}. What you see is from before; trying again.`;
      }
      const restarted = standing.restartedAt ? `The station has restarted; connected again at ${clock(standing.restartedAt)}. ` : "";
      const [trouble] = standing.troubles.values();
      return restarted + (trouble ? `Part of this page may be from before: ${trouble}. Trying again.` : "");
    });
    // What was seen and done here is not for who logs in next.
    watch(() => standing.loggedOut, (out) => document.body.classList.toggle("cv-out", out));
    const forget = () => sessionStorage.clear();
    return { forget, session, standing, noteRestart, words, dark, turn, logIn, logOut: page("/session/end") };
  },
  template: `
    <div class="cv-standing">
      <p v-if="words" class="cv-alarm" role="status">{{ words }}
        <a v-if="standing.loggedOut" :href="logIn()" @click="$event.currentTarget.href = logIn()">Log in</a>
        <button v-else-if="standing.restartedAt && standing.lostSince === null" @click="noteRestart(null)">OK</button>
      </p>
      <button class="cv-quiet" @click="turn">{{ dark ? "Switch to light" : "Switch to dark" }}</button>
      <form v-if="session?.name && !standing.loggedOut" method="post" :action="logOut" @submit="forget">
        <button class="cv-quiet" type="submit">Log out {{ session.name }}</button>
      </form>
    </div>`,
};
