// How often something comes, from a counter that is read now and then.
const WINDOW_MS = 30000;

export class Rates {
  constructor() {
    this.read = [];
  }

  // `counters` by name. One that falls, as after a restart of the station, begins anew.
  take(counters, nowMs) {
    const last = this.read.at(-1);
    if (last && Object.entries(counters).some(([name, value]) => value < last.counters[name])) this.read = [];
    this.read.push({ counters, nowMs });
    while (this.read.length > 2 && nowMs - this.read[0].nowMs > WINDOW_MS) this.read.shift();
  }

  // A second, of late; null while that cannot be told.
  of(name) {
    const [first, last] = [this.read[0], this.read.at(-1)];
    if (!last || last.nowMs - first.nowMs < 900) return null;
    return (1000 * (last.counters[name] - first.counters[name])) / (last.nowMs - first.nowMs);
  }
}
