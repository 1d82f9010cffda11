// Which part of the ground a map shows: x to the right and y up in metres, to pixels.
// Views reach beyond those who look.
const MARGIN = 0.18;
const LEAST_M = 1;

export class MapWindow {
  constructor() {
    this.centre = [0, 0];
    this.pxPerM = 40;
    this.size = [1, 1];
  }

  px([x, y]) {
    return [this.size[0] / 2 + (x - this.centre[0]) * this.pxPerM, this.size[1] / 2 - (y - this.centre[1]) * this.pxPerM];
  }

  metres([u, v]) {
    return [this.centre[0] + (u - this.size[0] / 2) / this.pxPerM, this.centre[1] - (v - this.size[1] / 2) / this.pxPerM];
  }

  // Show all places, as large as fits. `ease` is the share of the way that is gone now.
  fit(places, ease = 1) {
    if (!places.length) return;
    let [left, low, right, high] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const [x, y] of places) {
      left = Math.min(left, x);
      right = Math.max(right, x);
      low = Math.min(low, y);
      high = Math.max(high, y);
    }
    const room = 1 - 2 * MARGIN;
    const scale = Math.min(
      (room * this.size[0]) / Math.max(right - left, LEAST_M),
      (room * this.size[1]) / Math.max(high - low, LEAST_M),
    );
    this.pxPerM += ease * (scale - this.pxPerM);
    this.centreOn([(left + right) / 2, (low + high) / 2], ease);
  }

  centreOn([x, y], ease = 1) {
    this.centre = [this.centre[0] + ease * (x - this.centre[0]), this.centre[1] + ease * (y - this.centre[1])];
  }

  // Zoom so that the ground under a pixel stays there.
  zoom(factor, at = [this.size[0] / 2, this.size[1] / 2]) {
    const before = this.metres(at);
    this.pxPerM = Math.min(5000, Math.max(0.05, this.pxPerM * factor));
    const after = this.metres(at);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
  }

  pan(dx, dy) {
    this.centre = [this.centre[0] - dx / this.pxPerM, this.centre[1] + dy / this.pxPerM];
  }

  // A round length for a bar of some `px` pixels: metres and pixels.
  bar(px) {
    const most = px / this.pxPerM;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((step) => step * power).find((each) => each <= most);
    return [length, length * this.pxPerM];
  }
}
