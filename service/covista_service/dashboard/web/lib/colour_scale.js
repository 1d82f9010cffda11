// Colours for shares: lightness runs evenly from one end to the other and hue from violet over blue and green to
// yellow, so that the order is seen by eyes that tell few colours apart, and in grey. On dark paper more is lighter,
// on light paper more is darker: nothing at all always looks most like the paper.
const STOPS = ["#2b1a52", "#3d3a82", "#366095", "#2e8494", "#3fa887", "#86c76b", "#d9e394", "#fcfae6"];
const STEPS = 256;

// Of a colour as style sheets write it: [r, g, b].
export const channels = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));

// The colour [r, g, b] of a share from 0 to 1.
export function colourAt(share, dark) {
  const along = Math.min(1, Math.max(0, dark ? share : 1 - share)) * (STOPS.length - 1);
  const first = Math.min(STOPS.length - 2, Math.floor(along));
  const [from, to] = [channels(STOPS[first]), channels(STOPS[first + 1])];
  return from.map((value, k) => Math.round(value + (along - first) * (to[k] - value)));
}

export const css = ([r, g, b]) => `rgb(${r}, ${g}, ${b})`;

// Black or white, whichever is read better on a colour (by relative luminance, WCAG 2).
export function inkOn(colour) {
  const [r, g, b] = colour.map((value) => (value <= 10 ? value / 3294 : ((value / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.179 ? "#000000" : "#ffffff";
}

// Pixels as a canvas holds them, of shares in even steps.
export function table(dark) {
  const bytes = new Uint8ClampedArray(4 * STEPS);
  for (let k = 0; k < STEPS; k++) bytes.set([...colourAt(k / (STEPS - 1), dark), 255], 4 * k);
  return new Uint32Array(bytes.buffer);
}

// What a matrix is drawn by: how strong a value is from 0 to 1 (NaN: unknown), and how it is written.
const shares = { strength: (value) => value, text: (value) => value.toFixed(2), ticks: [0, 0.25, 0.5, 0.75, 1], top: 1 };
export const MATRICES = {
  similarity: { name: "similarity", title: "Similarity: from 0 (nothing in common) to 1; what groups are made by" },
  overlap: { name: "overlap", title: "Overlap: the share of the row's view that the column sees" },
  closeness: { name: "closeness", title: "Closeness: from 0 (far) to 1 (in one place)" },
  distance_m: { name: "distance", title: "Distance in metres; near is drawn strong" },
};

// Distances end where most of them do, at a round number: one robot far away would make all others look alike.
export function measureOf(kind, values) {
  if (kind === "overlap") return { ...shares, text: (value) => `${Math.round(100 * value)} %` };
  if (kind !== "distance_m") return shares;
  const top = roundUp(most(values));
  const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) => share * top);
  return { strength: (value) => 1 - value / top, text: (value) => metres(value), ticks, top };
}

export const metres = (value) => `${value < 10 ? value.toFixed(1) : Math.round(value)} m`;

function most(values) {
  const stride = Math.max(1, Math.floor(values.length / 20011));
  const sample = [];
  for (let k = 0; k < values.length; k += stride) if (values[k] > 0) sample.push(values[k]);
  sample.sort((a, b) => a - b);
  return sample.length ? sample[Math.floor(0.95 * (sample.length - 1))] : 1;
}

function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 4, 6, 8, 10].map((step) => step * power).find((each) => each >= value * (1 - 1e-9)) ?? 10 * power;
}
