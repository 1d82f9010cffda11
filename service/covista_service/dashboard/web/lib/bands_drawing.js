// Draws groups over time: a row a robot, coloured by its group, and above them the scale with what happened.
import { channels, inkOn } from "covista/colour_scale.js";
import { colourOf, shapeOf, trace } from "covista/looks.js";
import { marks } from "covista/moments.js";

export const GUTTER = 58;
export const HEAD = 44;
export const GLYPHS = { join: "+", leave: "−", split: "◁", merge: "▷", moved: "↕", status: "○", settings: "≡", warning: "!" };
const EVENT_Y = 12;
const [LEAST_ROW, MOST_ROW] = [3, 22];
const MARK = 9;
const inks = (dark) =>
  dark
    ? { paper: "#1b2128", ink: "#e8e8e8", soft: "#b3b9c0", line: "#37404a", none: "#8a949e" }
    : { paper: "#ffffff", ink: "#1c1c1c", soft: "#565656", line: "#d4d4ce", none: "#767676" };

export const rowHeight = (count) => Math.max(LEAST_ROW, Math.min(MOST_ROW, Math.floor(330 / Math.max(count, 1))));

// Milliseconds to pixels of a canvas `width` wide, and back.
export class Scale {
  constructor(sinceMs, untilMs, width) {
    Object.assign(this, { sinceMs, untilMs, width });
    this.pxPerMs = Math.max(1, width - GUTTER - 6) / Math.max(1, untilMs - sinceMs);
  }

  px(ms) {
    return GUTTER + (ms - this.sinceMs) * this.pxPerMs;
  }

  ms(px) {
    return Math.min(this.untilMs, Math.max(this.sinceMs, this.sinceMs + (px - GUTTER) / this.pxPerMs));
  }
}

export function drawHead(context, scale, events, timeMs, dark) {
  const look = inks(dark);
  context.fillStyle = look.paper;
  context.fillRect(0, 0, scale.width, HEAD);
  context.font = "12px system-ui, sans-serif";
  context.textBaseline = "middle";
  for (const { ms, words } of marks(scale.sinceMs, scale.untilMs, Math.max(2, (scale.width - GUTTER) / 90))) {
    const x = Math.round(scale.px(ms)) + 0.5;
    line(context, x, HEAD - 6, HEAD, look.soft);
    const half = context.measureText(words).width / 2;
    context.fillStyle = look.soft;
    context.fillText(words, Math.min(scale.width - 2 * half - 2, Math.max(GUTTER, x - half)), HEAD - 14);
  }
  context.font = "700 13px system-ui, sans-serif";
  context.textAlign = "center";
  let last = -Infinity;
  for (const event of events) {
    const x = scale.px(event.ms);
    if (x < GUTTER - 1 || x > scale.width || x - last < 9) continue;
    last = x;
    context.fillStyle = look.ink;
    context.fillText(GLYPHS[event.event] ?? "·", x, EVENT_Y);
  }
  context.textAlign = "left";
  if (timeMs !== null) drawTime(context, scale.px(timeMs), 0, HEAD, look, true);
}

export function drawRows(context, scale, bands, timeMs, dark) {
  const look = inks(dark);
  const height = rowHeight(bands.robots.length);
  const foot = height * bands.robots.length;
  context.fillStyle = look.paper;
  context.fillRect(0, 0, scale.width, Math.max(foot, 1));
  for (const { ms } of marks(scale.sinceMs, scale.untilMs, Math.max(2, (scale.width - GUTTER) / 90))) {
    line(context, Math.round(scale.px(ms)) + 0.5, 0, foot, look.line);
  }
  let above = [];
  bands.robots.forEach((robot, row) => {
    above = drawRow(context, scale, runsOf(bands, robot), row * height, height, above, look, dark);
    if (height < 11) return;
    context.font = `${Math.min(13, height - 1)}px system-ui, sans-serif`;
    context.fillStyle = look.ink;
    context.fillText(short(context, robot, GUTTER - 8), 2, (row + 0.5) * height);
  });
  bands.gaps.forEach((gap) => hatch(context, scale.px(gap.since_ms), scale.px(gap.until_ms), foot, look));
  if (timeMs !== null) drawTime(context, scale.px(timeMs), 0, foot, look, false);
}

// A robot's runs with their ends: [{ from, to, label }].
export function runsOf(bands, robot) {
  const runs = bands.runs[robot] ?? [];
  return runs.map(([from, label], k) => ({ from, to: runs[k + 1]?.[0] ?? bands.until_ms, label }));
}

// One robot; gives where it has written labels, for those below need not say the same again.
function drawRow(context, scale, runs, top, height, above, look, dark) {
  const written = [];
  const air = height > 6 ? 1 : 0;
  context.textBaseline = "middle";
  for (const { from, to, label } of runs) {
    if (to < scale.sinceMs || label === "") continue;
    const left = Math.max(GUTTER, scale.px(from));
    // A gap where a label changes, but nothing vanishes for it.
    const width = Math.max(1, scale.px(to) - left - (air && scale.px(to) - left > 3 ? 1.5 : 0));
    if (label === null) {
      context.fillStyle = look.none;
      context.fillRect(left, top + height / 2 - 1, width, Math.min(2, height));
      continue;
    }
    context.fillStyle = colourOf(label, dark);
    context.fillRect(left, top, width, height - air);
    if (height < 12) continue;
    context.font = `650 ${Math.min(12, height - 2)}px system-ui, sans-serif`;
    const room = context.measureText(label).width + MARK + 9;
    if (width < room) continue;
    const said = above.find((each) => each.label === label && Math.abs(each.left - left) < 2);
    written.push({ label, left });
    if (!said) drawLabel(context, label, left + 4, top + height / 2, dark);
  }
  return written;
}

// The shape of a group and its label, for who does not tell its colour from others.
function drawLabel(context, label, x, y, dark) {
  context.fillStyle = inkOn(channels(colourOf(label, dark)));
  trace(context, shapeOf(label), x + MARK / 2, y, 0.4 * MARK);
  context.fill();
  context.fillText(label, x + MARK + 2, y);
}

function hatch(context, left, right, foot, look) {
  const [from, to] = [Math.max(GUTTER, left), Math.max(GUTTER + 3, right, left + 3)];
  context.save();
  context.beginPath();
  context.rect(from, 0, to - from, foot);
  context.clip();
  context.fillStyle = look.paper;
  context.globalAlpha = 0.75;
  context.fillRect(from, 0, to - from, foot);
  context.globalAlpha = 1;
  context.strokeStyle = look.soft;
  context.lineWidth = 1;
  context.beginPath();
  for (let x = from - foot; x < to; x += 7) {
    context.moveTo(x, foot);
    context.lineTo(x + foot, 0);
  }
  context.stroke();
  context.restore();
}

function drawTime(context, x, top, foot, look, knob) {
  line(context, x, top, foot, look.paper, 5);
  line(context, x, top, foot, look.ink, 2);
  if (!knob) return;
  context.fillStyle = look.ink;
  context.beginPath();
  context.moveTo(x - 6, foot - 8);
  context.lineTo(x + 6, foot - 8);
  context.lineTo(x, foot);
  context.fill();
}

function line(context, x, top, foot, colour, width = 1) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  context.moveTo(x, top);
  context.lineTo(x, foot);
  context.stroke();
}

function short(context, words, room) {
  if (context.measureText(words).width <= room) return words;
  let cut = words.length - 1;
  while (cut > 1 && context.measureText(`${words.slice(0, cut)}…`).width > room) cut -= 1;
  return `${words.slice(0, cut)}…`;
}
