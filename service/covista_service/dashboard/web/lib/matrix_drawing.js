// Draws a matrix of robots ordered by group: cells by colour, unknown ones hatched, groups outlined and named.
import { colourAt, inkOn, table } from "covista/colour_scale.js";
import { colourOf, shapeOf, trace } from "covista/looks.js";

const NAMES_FROM_PX = 13;
const NUMBERS_FROM_PX = 34;
// Cells that are smaller are found by lines that run to them.
const CROSSED_UP_TO_PX = 16;
const LARGEST_PX = 84;
const BAND_PX = 7;
const FONT = "system-ui, sans-serif";

// Where things are: `left` and `top` of the cells and the length of each in px, for `count` robots in a square `side`.
export function layoutOf(count, side, names, blocks) {
  const cellAt = (margin) => Math.min(LARGEST_PX, Math.max(0, side - margin - 2) / Math.max(1, count));
  const named = 10 + Math.min(16, Math.max(2, ...names.map((name) => name.length))) * 7.2;
  const labelled = BAND_PX + 26 + Math.max(2, ...blocks.map((block) => (block.label ?? "none").length)) * 7.2;
  const withNames = cellAt(labelled + named) >= NAMES_FROM_PX;
  const margin = labelled + (withNames ? named : 0);
  return { margin, cell: cellAt(margin), withNames, count };
}

// Of a square of at most `most` px, as much as so many robots need.
export function sideOf(count, most, names, blocks) {
  const { margin, cell } = layoutOf(count, most, names, blocks);
  return Math.min(most, count ? Math.ceil(margin + cell * count + 2) : most);
}

// The row and the column under a pixel; null outside.
export function cellUnder(layout, [x, y]) {
  const [column, row] = [x, y].map((at) => Math.floor((at - layout.margin) / layout.cell));
  const inside = (at) => at >= 0 && at < layout.count;
  return inside(row) && inside(column) ? [row, column] : null;
}

// Cells as pictures of a pixel each: how strong known ones are, and where unknown ones are.
function cellsOf({ values, order, measure }, dark, size) {
  const count = order.length;
  const colours = table(dark);
  const [known, unknown] = [new ImageData(count, count), new ImageData(count, count)];
  const [shown, hidden] = [new Uint32Array(known.data.buffer), new Uint32Array(unknown.data.buffer)];
  for (let row = 0, k = 0; row < count; row++) {
    const start = order[row] * size;
    for (let column = 0; column < count; column++, k++) {
      const strength = measure.strength(values[start + order[column]]);
      if (Number.isNaN(strength)) hidden[k] = 0xffffffff;
      else shown[k] = colours[Math.round(255 * Math.min(1, Math.max(0, strength)))];
    }
  }
  return [known, unknown].map(onCanvas);
}

function onCanvas(picture) {
  const canvas = new OffscreenCanvas(Math.max(1, picture.width), Math.max(1, picture.height));
  if (picture.width) canvas.getContext("2d").putImageData(picture, 0, 0);
  return canvas;
}

// All but what is chosen, in px of the page; `ratio` of them are a pixel of the screen.
export function drawMatrix(context, layout, matrix, { dark, ink, paper, soft, ratio }) {
  const { margin, cell, count } = layout;
  const side = cell * count;
  const [known, unknown] = cellsOf(matrix, dark, matrix.robots.length);
  context.imageSmoothingEnabled = cell * ratio < 1;
  context.drawImage(known, margin, margin, side, side);
  context.drawImage(hatched(unknown, side, ratio, { paper, soft }), margin, margin, side, side);
  if (cell >= NUMBERS_FROM_PX) numbers(context, layout, matrix, dark, ink, paper);
  else if (cell >= 6) grid(context, layout, paper);
  borders(context, layout, matrix.blocks, { dark, ink, paper });
  names(context, layout, matrix, { dark, ink });
}

// Unknown is no colour of the scale: stripes on paper.
function hatched(unknown, side, ratio, { paper, soft }) {
  const width = Math.max(1, Math.round(side * ratio));
  const canvas = new OffscreenCanvas(width, width);
  const context = canvas.getContext("2d");
  context.imageSmoothingEnabled = false;
  context.drawImage(unknown, 0, 0, width, width);
  context.globalCompositeOperation = "source-in";
  context.fillStyle = paper;
  context.fillRect(0, 0, width, width);
  context.globalCompositeOperation = "source-atop";
  context.strokeStyle = soft;
  context.lineWidth = 1.2 * ratio;
  context.beginPath();
  for (let at = -width; at < width; at += 6 * ratio) {
    context.moveTo(at, width);
    context.lineTo(at + width, 0);
  }
  context.stroke();
  return canvas;
}

function numbers(context, { margin, cell, count }, { values, order, measure, robots }, dark, ink, paper) {
  context.font = `${cell >= 52 ? 13 : 11}px ${FONT}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (let row = 0; row < count; row++) {
    for (let column = 0; column < count; column++) {
      const value = values[order[row] * robots.length + order[column]];
      const text = Number.isNaN(value) ? "?" : measure.text(value);
      const [x, y] = [margin + (column + 0.5) * cell, margin + (row + 0.5) * cell];
      if (text === "?") {
        context.fillStyle = paper;
        context.fillRect(x - 6, y - 8, 12, 16);
        context.fillStyle = ink;
      } else context.fillStyle = inkOn(colourAt(measure.strength(value), dark));
      context.fillText(text, x, y);
    }
  }
  grid(context, { margin, cell, count }, paper);
}

function grid(context, { margin, cell, count }, paper) {
  context.strokeStyle = paper;
  context.lineWidth = 0.6;
  context.beginPath();
  for (let k = 0; k <= count; k++) cross(context, margin, k * cell, count * cell);
  context.stroke();
}

function cross(context, margin, at, side) {
  context.moveTo(margin + at, margin);
  context.lineTo(margin + at, margin + side);
  context.moveTo(margin, margin + at);
  context.lineTo(margin + side, margin + at);
}

// Paper between groups, and a frame in the group's colour around what its own robots have in common.
function borders(context, { margin, cell, count }, blocks, { dark, ink, paper }) {
  const narrow = Math.min(...blocks.map(({ first, end }) => (end - first) * cell)) < 10;
  for (const [colour, width] of narrow ? [[paper, 1]] : [[paper, 4], [ink, 1]]) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    for (const { first } of blocks.slice(1)) cross(context, margin, first * cell, count * cell);
    context.stroke();
  }
  for (const { label, first, end } of blocks) {
    const [at, length] = [margin + first * cell, (end - first) * cell];
    context.fillStyle = context.strokeStyle = colourOf(label, dark);
    context.fillRect(margin - BAND_PX - 3, at + 1, BAND_PX, Math.max(1, length - 2));
    context.fillRect(at + 1, margin - BAND_PX - 3, Math.max(1, length - 2), BAND_PX);
    if (label === null || length < 6) continue;
    context.lineWidth = 2.5;
    context.strokeRect(at, at, length, length);
  }
}

// Left of the rows and above the columns: robots where there is room, and groups with their shapes.
function names(context, { margin, cell, withNames }, { robots, order, blocks }, { dark, ink }) {
  const edge = margin - BAND_PX - 7;
  const write = (words, at, room, label) => {
    context.save();
    context.translate(edge, margin + at);
    line(context, words, room, label, "right");
    context.restore();
    context.save();
    context.translate(margin + at, edge);
    context.rotate(-Math.PI / 2);
    line(context, words, room, label, "left");
    context.restore();
  };
  // Words that end at the cells or begin there; those of groups stand `room` further out, behind their shape.
  const line = (pen, words, room, label, align) => {
    const out = align === "right" ? -1 : 1;
    pen.textAlign = align;
    pen.fillStyle = ink;
    pen.fillText(words, out * room, 0);
    if (label === undefined) return;
    pen.fillStyle = colourOf(label, dark);
    pen.translate(out * (room + pen.measureText(words).width + 9), 0);
    // Words above columns are turned, and a shape that is turned is another.
    if (align === "left") pen.rotate(Math.PI / 2);
    trace(pen, shapeOf(label), 0, 0, 5);
    pen.fill();
  };
  context.textBaseline = "middle";
  let room = 0;
  if (withNames) {
    context.font = `${Math.min(13, cell - 1)}px ${FONT}`;
    order.forEach((place, k) => write(robots[place], (k + 0.5) * cell, 0));
    room = Math.max(...robots.map((name) => context.measureText(name).width)) + 10;
  }
  context.font = `650 12px ${FONT}`;
  let free = -Infinity;
  for (const { label, first, end } of blocks) {
    const at = 0.5 * (first + end) * cell;
    if ((end - first) * cell < 4 || at < free) continue;
    write(label ?? "none", at, room, label);
    free = at + 14;
  }
}

// A cell and its mirror image, and which row and column it stands in.
export function drawChosen(context, { margin, cell, count }, [row, column], { ink, paper }) {
  const spot = (i, j) => [margin + j * cell - 1, margin + i * cell - 1, Math.max(cell, 5) + 2, Math.max(cell, 5) + 2];
  const frame = (box, width, dashes = []) => {
    context.setLineDash(dashes);
    for (const [colour, wide] of [[paper, width + 2], [ink, width]]) {
      context.strokeStyle = colour;
      context.lineWidth = wide;
      context.strokeRect(...box);
    }
    context.setLineDash([]);
  };
  if (cell < CROSSED_UP_TO_PX) {
    const side = cell * count;
    frame([margin, margin + row * cell, side, cell], 1);
    frame([margin + column * cell, margin, cell, side], 1);
  } else if (row !== column) frame(spot(column, row), 1.5, [4, 4]);
  frame(spot(row, column), 3);
  // Beside the colours of the groups, not over them.
  context.fillStyle = ink;
  context.fillRect(margin - 3, margin + row * cell, 2, Math.max(3, cell));
  context.fillRect(margin + column * cell, margin - 3, Math.max(3, cell), 2);
}
