// At the top of every page: whether the station answers, light or dark, and the way out.
import { computed, onMounted, ref, watch } from "vue";
import { asked, data, heardOf, noteRestart, page, standing } from "covista/ask.js";
import { pulse } from "covista/pulse.js";

const DARK = "covista-dark";
const EVERY_MS = 2000;

export default {
  setup() {
    const session = ref(null);
    const now = ref(Date.now());
    pulse(async () => {
      session.value = await asked(data("/session"));
      heardOf(session.value.station);
      now.value = Date.now();
    }, EVERY_MS, () => (now.value = Date.now()));
    const kept = localStorage.getItem(DARK);
    onMounted(() => {
      if (kept !== null) Quasar.Dark.set(kept === "true");
    });
    const turn = () => {
      const dark = !document.body.classList.contains("body--dark");
      Quasar.Dark.set(dark);
      localStorage.setItem(DARK, dark);
    };
    // Nothing is let in any more that this page would try again and again.
    watch(() => standing.loggedOut, () => globalThis.socket?.disconnect());
    const words = computed(() => {
      if (standing.loggedOut) return "You are not logged in any more.";
      if (standing.lostSince !== null) {
        const seconds = Math.max(0, Math.round((now.value - standing.lostSince) / 1000));
        return `The station has not answered for ${seconds} s. What you see is from before; trying again.`;
      }
      if (standing.restartedAt) return `The station has restarted; connected again at ${standing.restartedAt.toLocaleTimeString()}.`;
      return "";
    });
    return { session, standing, noteRestart, words, turn, logIn: page("/log-in"), logOut: page("/session/end") };
  },
  template: `
    <div class="cv-standing">
      <p v-if="words" class="cv-alarm" role="status">{{ words }}
        <a v-if="standing.loggedOut" :href="logIn">Log in</a>
        <button v-else-if="standing.restartedAt && standing.lostSince === null" @click="noteRestart(null)">Good</button>
      </p>
      <button class="cv-quiet" @click="turn">Light or dark</button>
      <form v-if="session?.name" method="post" :action="logOut">
        <button class="cv-quiet" type="submit">Log out {{ session.name }}</button>
      </form>
    </div>`,
};
