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

  // A minute, or as much of one as was watched, of what `read` finds in an answer; null before there are two answers.
  rate(read) {
    const last = this.all.at(-1);
    const first = this.all.find(({ at }) => last.at - at <= RATE_MS);
    if (!last || first === last) return null;
    return (Math.max(0, (read(last.answer) ?? 0) - (read(first.answer) ?? 0)) * 60000) / (last.at - first.at);
  }

  // How much more of `what` for each of `of` in that time; null where there was none.
  ratio(what, of) {
    const [more, each] = [this.rate(what), this.rate(of)];
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
