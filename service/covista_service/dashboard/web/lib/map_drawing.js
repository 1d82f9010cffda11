// Draws the swarm from above on a canvas.
import { colourOf, shapeOf, trace } from "covista/looks.js";

const RADIUS = 7;
const SMALL = 4;
// Beyond so many robots less is drawn of each, and what looks the same is drawn in one go.
const MANY = 120;
const CLASSES = 4;
const VIEW_SHARE = 0.16;

const inks = (dark) =>
  dark
    ? { paper: "#14181d", ink: "#e8e8e8", grid: "#232a31", edge: "#8fa3b5", halo: "#14181d" }
    : { paper: "#fafaf8", ink: "#1c1c1c", grid: "#e9e9e4", edge: "#54636f", halo: "#fafaf8" };

// `shown`: robots as Motion gives them; `chosen`: ids; `hovered`: an id or null.
export function draw(context, window, shown, edges, { chosen, hovered, dark }) {
  const look = inks(dark);
  const [width, height] = window.size;
  context.fillStyle = look.paper;
  context.fillRect(0, 0, width, height);
  drawGrid(context, window, look);
  const placed = shown.filter((each) => each.at);
  const many = placed.length > MANY;
  const where = new Map(placed.map((each) => [each.robot.id, window.px(each.at)]));
  const reach = (VIEW_SHARE * Math.min(width, height)) / window.pxPerM / Math.max(1, Math.sqrt(placed.length / 12));
  if (!many) placed.forEach((each) => drawTrack(context, window, each, dark));
  drawEdges(context, edges, where, look, chosen, many);
  if (many) drawDirections(context, window, placed, reach, dark);
  placed.forEach((each) => {
    if (!many || chosen.includes(each.robot.id)) drawView(context, window, each, reach, dark, chosen);
  });
  const radius = many ? SMALL : RADIUS;
  placed.forEach((each) => drawRobot(context, where.get(each.robot.id), each.robot, radius, look, dark, chosen, hovered));
  drawNames(context, placed, where, radius, look, chosen, hovered, many);
  drawBar(context, window, look);
}

function drawGrid(context, window, look) {
  const [step] = window.bar(120);
  const [left, top] = window.metres([0, 0]);
  const [right, low] = window.metres(window.size);
  context.strokeStyle = look.grid;
  context.lineWidth = 1;
  context.beginPath();
  for (let x = Math.ceil(left / step) * step; x <= right; x += step) {
    const [u] = window.px([x, 0]);
    context.moveTo(Math.round(u) + 0.5, 0);
    context.lineTo(Math.round(u) + 0.5, window.size[1]);
  }
  for (let y = Math.ceil(low / step) * step; y <= top; y += step) {
    const [, v] = window.px([0, y]);
    context.moveTo(0, Math.round(v) + 0.5);
    context.lineTo(window.size[0], Math.round(v) + 0.5);
  }
  context.stroke();
}

function drawTrack(context, window, { robot, at, track }, dark) {
  if (track.length < 2) return;
  context.strokeStyle = colourOf(robot.group, dark);
  context.globalAlpha = 0.35;
  context.lineWidth = 1.5;
  context.beginPath();
  track.forEach((point, k) => (k ? context.lineTo(...window.px(point)) : context.moveTo(...window.px(point))));
  context.lineTo(...window.px(at));
  context.stroke();
  context.globalAlpha = 1;
}

function drawEdges(context, edges, where, look, chosen, many) {
  const classes = Array.from({ length: CLASSES }, () => []);
  const marked = [];
  // Of two who are chosen the line between them counts, of one all of its lines.
  const counts = ({ a, b }) => (chosen.length > 1 ? chosen.includes(a) && chosen.includes(b) : chosen.includes(a) || chosen.includes(b));
  for (const edge of edges) {
    const from = where.get(edge.a);
    const to = where.get(edge.b);
    if (!from || !to) continue;
    const share = Math.max(edge.ofFirst, edge.ofSecond);
    const drawn = [from, to, Math.min(CLASSES - 1, Math.floor(CLASSES * share))];
    if (counts(edge)) marked.push(drawn);
    else classes[drawn[2]].push(drawn);
  }
  const width = (level) => (many ? 0.6 + 0.5 * level : 1 + 1.4 * level);
  classes.forEach((lines, level) => {
    context.globalAlpha = (many ? 0.15 : 0.25) + 0.14 * level;
    strokeLines(context, lines, look.edge, width(level));
  });
  context.globalAlpha = 0.95;
  for (const line of marked) strokeLines(context, [line], look.ink, width(line[2]));
  context.globalAlpha = 1;
}

function strokeLines(context, lines, colour, width) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  for (const [from, to] of lines) {
    context.moveTo(...from);
    context.lineTo(...to);
  }
  context.stroke();
}

// Of many robots no more than where they look.
function drawDirections(context, window, placed, reach, dark) {
  const byColour = new Map();
  for (const { robot, at, view } of placed) {
    if (!view) continue;
    const ahead = [0, 1].map((axis) => at[axis] + (reach / 4) * (view[axis] + view[axis + 2] + view[axis + 4] + view[axis + 6]));
    const colour = colourOf(robot.group, dark);
    if (!byColour.has(colour)) byColour.set(colour, []);
    byColour.get(colour).push([window.px(at), window.px(ahead)]);
  }
  for (const [colour, lines] of byColour) strokeLines(context, lines, colour, 1.2);
}

// The field of view from above: the camera and the corners of its image, as far as the map has room for.
function drawView(context, window, { robot, at, view }, reach, dark, chosen) {
  if (!view) return;
  const points = [at];
  for (let k = 0; k < 8; k += 2) points.push([at[0] + reach * view[k], at[1] + reach * view[k + 1]]);
  const outline = hull(points).map((point) => window.px(point));
  context.beginPath();
  outline.forEach((point, k) => (k ? context.lineTo(...point) : context.moveTo(...point)));
  context.closePath();
  const marked = chosen.includes(robot.id);
  context.fillStyle = context.strokeStyle = colourOf(robot.group, dark);
  const faint = robot.status === "live" ? 1 : 0.4;
  context.globalAlpha = (marked ? 0.32 : 0.14) * faint;
  context.fill();
  context.globalAlpha = (marked ? 0.9 : 0.45) * faint;
  context.lineWidth = 1;
  context.stroke();
  context.globalAlpha = 1;
}

// Live: filled. Stale: an empty outline. Gone: an empty outline, crossed out.
function drawRobot(context, place, robot, radius, look, dark, chosen, hovered) {
  const [x, y] = place;
  const shape = shapeOf(robot.group);
  const colour = colourOf(robot.group, dark);
  if (chosen.includes(robot.id) || hovered === robot.id) {
    context.beginPath();
    context.arc(x, y, radius + 6, 0, 2 * Math.PI);
    context.strokeStyle = look.ink;
    context.lineWidth = chosen.includes(robot.id) ? 2.5 : 1;
    context.stroke();
  }
  trace(context, shape, x, y, radius);
  context.fillStyle = robot.status === "live" ? colour : look.paper;
  context.fill();
  context.lineWidth = 2;
  context.strokeStyle = robot.status === "live" ? look.halo : colour;
  if (robot.status === "stale") context.setLineDash([3, 2]);
  context.stroke();
  context.setLineDash([]);
  if (robot.status === "gone") {
    context.beginPath();
    context.moveTo(x - radius - 2, y - radius - 2);
    context.lineTo(x + radius + 2, y + radius + 2);
    context.moveTo(x + radius + 2, y - radius - 2);
    context.lineTo(x - radius - 2, y + radius + 2);
    context.strokeStyle = look.ink;
    context.lineWidth = 1.5;
    context.stroke();
  }
}

function drawNames(context, placed, where, radius, look, chosen, hovered, many) {
  context.font = "600 12px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  const taken = [];
  for (const { robot } of placed) {
    const marked = chosen.includes(robot.id) || hovered === robot.id;
    if (many && !marked) continue;
    const [x, y] = where.get(robot.id);
    const words = robot.status === "live" ? robot.id : `${robot.id} (${robot.status})`;
    const box = [x + radius + 4, y - 8, context.measureText(words).width, 16];
    // Names that lie on one another say nothing.
    if (!marked && taken.some((each) => Math.abs(each[1] - box[1]) < 13 && each[0] < box[0] + box[2] && box[0] < each[0] + each[2])) continue;
    taken.push(box);
    context.strokeStyle = look.halo;
    context.lineWidth = 4;
    context.strokeText(words, box[0], y);
    context.fillStyle = look.ink;
    context.fillText(words, box[0], y);
  }
}

function drawBar(context, window, look) {
  const [metres, px] = window.bar(Math.min(160, window.size[0] / 4));
  const [right, foot] = [window.size[0] - 16, window.size[1] - 14];
  context.strokeStyle = context.fillStyle = look.ink;
  context.lineWidth = 2;
  context.beginPath();
  [[right - px, foot - 6], [right - px, foot], [right, foot], [right, foot - 6]].forEach((point, k) =>
    k ? context.lineTo(...point) : context.moveTo(...point),
  );
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  const words = `${metres >= 1 ? metres : Number(metres.toPrecision(1))} m`;
  context.fillText(words, right - px / 2 - context.measureText(words).width / 2, foot - 12);
}

// The convex hull of a few points (Andrew's monotone chain).
function hull(points) {
  const sorted = [...points].sort((p, q) => p[0] - q[0] || p[1] - q[1]);
  const half = (ordered) => {
    const chain = [];
    for (const point of ordered) {
      while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), point) <= 0) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
