// A matrix as text: all of it for a few robots, else the row of one.
import { computed, ref } from "vue";
import { page } from "covista/ask.js";

const ALL_UP_TO = 14;
const MOST_ROWS = 100;

export default {
  props: { matrix: { type: Object, required: true }, kind: { type: String, required: true }, robot: { type: String, default: null } },
  setup(props) {
    const open = ref(false);
    const told = (value) => (Number.isNaN(value) ? "?" : props.matrix.measure.text(value));
    const whole = computed(() => props.matrix.order.length <= ALL_UP_TO);
    const names = computed(() => props.matrix.order.map((place) => props.matrix.robots[place]));
    const rows = computed(() => {
      if (!open.value || !whole.value) return [];
      const { robots, values, order } = props.matrix;
      return order.map((row) => ({ name: robots[row], cells: order.map((column) => told(values[row * robots.length + column])) }));
    });
    // Whom a robot has most in common with comes first.
    const others = computed(() => {
      const { robots, values, measure } = props.matrix;
      const row = robots.indexOf(props.robot);
      if (!open.value || whole.value || row < 0) return [];
      const strength = (value) => (Number.isNaN(value) ? -1 : measure.strength(value));
      const at = (i, j) => values[i * robots.length + j];
      return robots
        .map((name, column) => ({ name, value: at(row, column), back: at(column, row) }))
        .filter((each) => each.name !== props.robot)
        .sort((p, q) => strength(q.value) - strength(p.value))
        .slice(0, MOST_ROWS)
        .map(({ name, value, back }) => ({ name, value: told(value), back: told(back) }));
    });
    return { open, whole, names, rows, others, page, MOST_ROWS };
  },
  template: `
    <details class="cv-details" @toggle="open = $event.target.open">
      <summary>{{ whole ? 'The same as a table' : 'The row of ' + (robot ?? 'a robot') + ' as a table' }}</summary>
      <div v-if="open && whole" class="cv-scroll" tabindex="0" role="region" aria-label="The matrix as a table">
        <table class="cv-table cv-cells">
          <thead><tr><td></td><th v-for="name in names" :key="name" scope="col" class="cv-number">{{ name }}</th></tr></thead>
          <tbody><tr v-for="row in rows" :key="row.name"><th scope="row">{{ row.name }}</th>
            <td v-for="(cell, k) in row.cells" :key="k" class="cv-number">{{ cell }}</td></tr></tbody>
        </table>
      </div>
      <div v-else-if="open" class="cv-scroll cv-low" tabindex="0" role="region" aria-label="The row of a robot as a table">
        <table class="cv-table">
          <thead><tr><th scope="col">Robot</th><th scope="col" class="cv-number">{{ kind === 'overlap' ? 'it sees of ' + robot + "'s view" : kind }}</th>
            <th v-if="kind === 'overlap'" scope="col" class="cv-number">{{ robot }} sees of its view</th></tr></thead>
          <tbody><tr v-for="each in others" :key="each.name">
            <th scope="row"><a :href="page('/pairs/' + robot + '/' + each.name)">{{ each.name }}</a></th>
            <td class="cv-number">{{ each.value }}</td><td v-if="kind === 'overlap'" class="cv-number">{{ each.back }}</td></tr></tbody>
        </table>
        <p v-if="others.length === MOST_ROWS" class="cv-soft">The first {{ MOST_ROWS }}.</p>
      </div>
    </details>`,
};
