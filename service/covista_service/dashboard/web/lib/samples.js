// What a station told again and again while a page stands: how fast its counts grow now, and how its numbers went.
const RATE_MS = 60000;
const KEPT_MS = 300000;

export class Samples {
  constructor() {
    this.all = [];
    this.station = null;
  }

  // An answer came; counts of another start of the station are no continuation.
  take(answer, atMs) {
    if (answer.station !== this.station) this.all = [];
    this.station = answer.station;
    this.all = [...this.all.filter(({ at }) => atMs - at < KEPT_MS), { at: atMs, answer }];
  }

  // What of the samples is looked at: the last minute, or as much of one as was watched; null before there are two.
  watched() {
    const last = this.all.at(-1);
    const first = this.all.find(({ at }) => last.at - at <= RATE_MS);
    return first === last ? null : { first: first.answer, last: last.answer, ms: last.at - first.at };
  }

  // Whether so much was watched that something can be said of how often things happen.
  spans(leastMs) {
    const watched = this.watched();
    return watched !== null && watched.ms >= leastMs;
  }

  // How much a minute comes of what `read` finds in an answer; null before `leastMs` were watched.
  rate(read, leastMs) {
    if (!this.spans(leastMs)) return null;
    const { first, last, ms } = this.watched();
    return (Math.max(0, (read(last) ?? 0) - (read(first) ?? 0)) * 60000) / ms;
  }

  // How much more of `what` for each of `of` in that time, however short it is; null where there was none.
  ratio(what, of) {
    const [more, each] = [this.rate(what, 0), this.rate(of, 0)];
    return each ? more / each : null;
  }

  values(read) {
    return this.all.map(({ answer }) => read(answer) ?? null);
  }

  // The same between each two answers.
  ratios(what, of) {
    return this.all.slice(1).map(({ answer }, k) => {
      const before = this.all[k].answer;
      const each = of(answer) - of(before);
      return each > 0 ? (what(answer) - what(before)) / each : null;
    });
  }
}
