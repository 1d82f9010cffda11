// The planes behind a pair's common field, in the colours of the pictures.
const COLOURS = 6;
const LEVEL = 0.94;
const UPRIGHT = 0.34;

// How a plane lies, by its normal in the world, whose z points up.
export function lie([, , z]) {
  if (Math.abs(z) > LEVEL) return "level";
  return Math.abs(z) < UPRIGHT ? "upright" : "sloping";
}

const signed = (value) => (Math.abs(value) < 0.005 ? "0.00" : value.toFixed(2)).replace("-", "\u2212");

export default {
  props: { planes: { type: Array, required: true } },
  setup: () => ({ lie, signed, COLOURS }),
  template: `
    <div class="cv-scroll" tabindex="0" role="region" aria-label="Planes">
      <table class="cv-table">
        <thead><tr><th scope="col">Plane</th><th scope="col" class="cv-number">Points</th><th scope="col">Lies</th>
          <th scope="col" class="cv-number">Normal x, y, z</th><th scope="col" class="cv-number">Offset</th></tr></thead>
        <tbody><tr v-for="(plane, k) in planes" :key="k">
          <th scope="row"><svg class="cv-swatch" viewBox="0 0 16 16" width="14" height="14" aria-hidden="true"><rect :class="'cv-plane-' + (k % COLOURS)" width="16" height="16"></rect></svg> {{ k + 1 }}</th>
          <td class="cv-number">{{ plane.support }}</td><td>{{ lie(plane.normal) }}</td>
          <td class="cv-number">{{ plane.normal.map(signed).join(', ') }}</td>
          <td class="cv-number">{{ signed(plane.offset_m) }} m</td></tr></tbody>
      </table>
    </div>`,
};
