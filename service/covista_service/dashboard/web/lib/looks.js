// How groups and robots look, the same on all pages. A label keeps its colour and its shape for good, by its number: seven
// colours and six shapes, so that the next one differs in both and the first pair comes again after 42. The colours are
// after Okabe and Ito (2008), told apart by eyes that see fewer, without greys; those for the dark are lighter.
const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#b0508f", "#8a6d00", "#5a3fb8", "#1f1f1f"];
const DARK = ["#56b4e9", "#ff8c42", "#2fd0a0", "#e59cc9", "#f0e442", "#b3a1ff", "#f5f5f5"];
const SHAPES = ["circle", "square", "triangle", "diamond", "pentagon", "cross"];
const NONE = { light: "#767676", dark: "#9a9a9a" };

export const isDark = () => document.body.classList.contains("body--dark");

const numberOf = (label) => (label ? Number(label.slice(1)) || 0 : 0);

export function colourOf(label, dark = isDark()) {
  if (!label) return dark ? NONE.dark : NONE.light;
  const palette = dark ? DARK : LIGHT;
  return palette[(numberOf(label) + palette.length - 1) % palette.length];
}

export const shapeOf = (label) => (label ? SHAPES[(numberOf(label) + SHAPES.length - 1) % SHAPES.length] : "circle");

// The outline of a shape around a place, as a path of a canvas.
export function trace(context, shape, x, y, r) {
  context.beginPath();
  const corners = { square: [4, 0.25], triangle: [3, 0.5], diamond: [4, 0], pentagon: [5, 0.5] }[shape];
  if (shape === "cross") {
    const a = 0.38 * r;
    const points = [[-a, -r], [a, -r], [a, -a], [r, -a], [r, a], [a, a], [a, r], [-a, r], [-a, a], [-r, a], [-r, -a], [-a, -a]];
    points.forEach(([dx, dy], k) => (k ? context.lineTo(x + dx, y + dy) : context.moveTo(x + dx, y + dy)));
  } else if (corners) {
    const [n, turn] = corners;
    for (let k = 0; k < n; k++) {
      const angle = (2 * Math.PI * (k + (turn === 0.5 ? 0 : turn * 2))) / n - Math.PI / 2;
      const [px, py] = [x + 1.25 * r * Math.cos(angle), y + 1.25 * r * Math.sin(angle)];
      if (k) context.lineTo(px, py);
      else context.moveTo(px, py);
    }
  } else {
    context.arc(x, y, r, 0, 2 * Math.PI);
    return;
  }
  context.closePath();
}

// Why a robot stands in no group now.
export const REASONS = { no_pose: "has told no pose yet", gone: "is gone" };

export const counted = (count, what) => `${count} ${what}${count === 1 ? "" : "s"}`;

// g2 before g10.
export const byLabel = (a, b) => numberOf(a) - numberOf(b) || (a < b ? -1 : 1);
export const byName = (a, b) => a.localeCompare(b, "en", { numeric: true });
export const percent = (share) => (share === null || share === undefined ? "unknown" : `${Math.round(100 * share)} %`);

// How a robot is that is not live, in words; of one that was never heard `seconds` is null.
export const silence = (status, seconds) => (seconds === null ? status : `${status}, silent for ${ago(seconds)}`);

export function ago(seconds) {
  if (seconds === null || seconds === undefined) return "never";
  if (seconds < 90) return `${Math.round(seconds)} s`;
  // Who watches a robot that is silent sees the time go on.
  if (seconds < 600) return `${Math.floor(seconds / 60)} min${seconds % 60 < 1 ? "" : ` ${Math.floor(seconds % 60)} s`}`;
  return seconds < 5400 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 360) / 10} h`;
}
