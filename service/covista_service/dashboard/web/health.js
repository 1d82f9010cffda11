// How the station is, in plain words: what needs somebody first, then what it drops and why, what waits, and how fast it is.
import { computed } from "vue";
import { page, root } from "covista/ask.js";
import { useHealth } from "covista/health_answers.js";
import { countsNow, headline, moodOf, needsNow, rounded } from "covista/health_needs.js";
import { fatesNow, latencyNow, waitingNow } from "covista/health_numbers.js";
import SparkLine from "covista/spark_line.js";

const LEVELS = { bad: "Wrong", warn: "Look", note: "Note" };

export default {
  components: { SparkLine },
  setup() {
    const { now, at, trouble, samples } = useHealth();
    // All of these look at the samples, which are new with each answer; the template asks for none before the first.
    const counts = computed(() => countsNow(now.value, samples));
    const happened = computed(() => counts.value.filter(({ total }) => total > 0));
    const needs = computed(() => needsNow(now.value, counts.value, samples));
    const line = computed(() => headline(now.value, needs.value, samples));
    const mood = computed(() => moodOf(now.value, needs.value, samples));
    const fates = computed(() => fatesNow(now.value, samples));
    const waiting = computed(() => waitingNow(now.value, samples));
    const latency = computed(() => latencyNow(now.value, samples));
    const ms = (value) => (value === null ? "not known yet" : `${Math.round(value)} ms`);
    return { now, trouble, at, needs, line, mood, fates, happened, waiting, latency, ms, rounded, page, root, LEVELS };
  },
  template: `
    <p v-if="!now" :class="trouble ? 'cv-problem' : 'cv-soft'" role="status">{{ trouble ? "No answer: " + trouble : "Asking the station." }}</p>
    <div v-else class="cv-health">
      <p v-if="trouble" class="cv-problem cv-wide" role="alert">What you see is from before: {{ trouble }} Trying again.</p>
      <section class="cv-card cv-wide" :class="'cv-mood-' + mood" aria-labelledby="cv-line">
        <h2 id="cv-line" class="cv-headline" aria-live="polite">{{ line }}</h2>
        <p class="cv-soft">{{ now.robots }} As of {{ at }}.</p>
        <ul v-if="needs.length" class="cv-needs">
          <li v-for="need in needs" :key="need.key" :class="'cv-need-' + need.level"><b>{{ LEVELS[need.level] }}</b>
            <span>{{ need.says }} <i>{{ need.todo }}</i>
              <span v-if="need.robots.length"> Most concerned: <template v-for="(robot, k) in need.robots" :key="robot">{{ k ? ", " : "" }}<a :href="page('/robots/' + robot)">{{ robot }}</a></template>.</span></span></li>
        </ul>
      </section>
      <section class="cv-card" aria-labelledby="cv-parts">
        <h2 id="cv-parts">Parts</h2>
        <table class="cv-table"><thead><tr><th scope="col">Part</th><th scope="col">How it is</th></tr></thead>
          <tbody><tr v-for="part in now.parts" :key="part.name"><th scope="row">{{ part.title }}</th>
            <td><b :class="part.status === 'ready' ? 'cv-fine' : 'cv-off'">{{ part.status === "ready" ? "works" : part.status }}</b>
              <template v-if="part.detail">; {{ part.detail }}</template></td></tr></tbody></table>
      </section>
      <section class="cv-card" aria-labelledby="cv-latency">
        <h2 id="cv-latency">From a keyframe to groups</h2>
        <p v-if="!latency.count">No keyframe has shown in the groups yet.</p>
        <template v-else>
          <p v-if="latency.mean_ms === null" class="cv-big"><small>{{ latency.judged ? "No keyframe in the last minute" : "Not known yet" }}</small></p>
          <p v-else class="cv-big">{{ ms(latency.mean_ms) }} <small>on average in the last minute</small></p>
          <spark-line :values="latency.past" name="Latency" unit="ms" wide></spark-line>
          <p class="cv-soft">Since this page was opened, the last five minutes at most<template v-if="latency.highest !== null">; highest {{ ms(latency.highest) }}</template>.</p>
          <p>Half of them within {{ ms(latency.p50_ms) }}, 99 of 100 within {{ ms(latency.p99_ms) }}, of {{ latency.count }} since the start; {{ latency.slow }} took longer than half a second.</p>
        </template>
      </section>
      <section class="cv-card cv-wide" aria-labelledby="cv-drops">
        <h2 id="cv-drops">Dropped, refused, lost</h2>
        <p v-if="!happened.length">Nothing, since the station started.</p>
        <table v-else class="cv-table">
          <thead><tr><th scope="col">What</th><th scope="col" class="cv-number">A minute now</th><th scope="col" class="cv-number">Since the start</th></tr></thead>
          <tbody><tr v-for="each in happened" :key="each.key" :class="{ 'cv-grave': each.grave }">
            <th scope="row">{{ each.about }}: {{ each.reason }}
              <small>{{ each.means }} <i>{{ each.todo }}</i>
                <template v-if="each.robots.length"> Most from <template v-for="([robot, count], k) in each.robots" :key="robot">{{ k ? ", " : "" }}<a :href="page('/robots/' + robot)">{{ robot }}</a> ({{ count }})</template>.</template></small></th>
            <td class="cv-number">{{ rounded(each.rate) }}</td><td class="cv-number">{{ each.total }}</td></tr></tbody>
        </table>
      </section>
      <section class="cv-card" aria-labelledby="cv-fates">
        <h2 id="cv-fates">What became of messages</h2>
        <table class="cv-table">
          <thead><tr><th scope="col">Since the start <small>a minute now</small></th><th v-for="each in now.fates" :key="each.topic" scope="col" class="cv-number">{{ each.topic }}s</th></tr></thead>
          <tbody><tr v-for="row in fates" :key="row.fate"><th scope="row">{{ row.title }}</th>
            <td v-for="cell in row.cells" :key="cell.topic" class="cv-number">{{ cell.total }}<small>{{ row.fate === "waiting" ? "" : rounded(cell.rate) }}</small></td></tr></tbody>
        </table>
        <p class="cv-soft">That newer messages overtake older ones is as it should be: the newest of everything is used.</p>
      </section>
      <section class="cv-card" aria-labelledby="cv-waiting">
        <h2 id="cv-waiting">What waits now</h2>
        <table class="cv-table">
          <thead><tr><th scope="col">What</th><th scope="col" class="cv-number">Now</th><th scope="col">Last minutes</th></tr></thead>
          <tbody><tr v-for="each in waiting" :key="each.key"><th scope="row">{{ each.name }}<small>{{ each.means }}</small></th>
            <td class="cv-number">{{ each.value }}</td><td><spark-line :values="each.past" :name="each.name"></spark-line></td></tr></tbody>
        </table>
      </section>
      <section class="cv-card" aria-labelledby="cv-facts">
        <h2 id="cv-facts">More of the station</h2>
        <dl class="cv-facts"><template v-for="[name, words] in now.facts" :key="name"><dt>{{ name }}</dt><dd>{{ words }}</dd></template></dl>
        <template v-if="now.odd_robots.length"><h3>Clocks and poses</h3>
          <ul><li v-for="each in now.odd_robots" :key="each.robot"><a :href="page('/robots/' + each.robot)">{{ each.robot }}</a>:
            <template v-if="each.clock_s !== null"> its clock is {{ Math.abs(each.clock_s) }} s {{ each.clock_s > 0 ? "fast" : "slow" }};</template>
            <template v-if="each.off_deg !== null"> its poses are {{ each.off_deg }} degrees and {{ each.off_m }} m off by its pictures</template></li></ul></template>
        <p>All numbers: <a :href="root + '/metrics'">metrics</a> for Prometheus; <a :href="root + '/docs'">what programs can ask</a>.</p>
      </section>
    </div>`,
};
