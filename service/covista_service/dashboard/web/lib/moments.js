// Times as people read them: by the clock of who looks, to the second.
const DAY_MS = 86400000;
const form = (options) => new Intl.DateTimeFormat("en-GB", { hourCycle: "h23", ...options });
const CLOCK = form({ hour: "2-digit", minute: "2-digit", second: "2-digit" });
const SHORT = form({ hour: "2-digit", minute: "2-digit" });
const DAY = form({ day: "numeric", month: "short" });
const FULL = form({ day: "numeric", month: "short", hour: "2-digit", minute: "2-digit", second: "2-digit" });
const ZONE = form({ timeZoneName: "shortOffset" });

// Lengths of time that a scale may have between two of its marks.
const STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400, 172800];

export const msOf = (time) => Date.parse(time);
export const clock = (ms) => CLOCK.format(ms);
// As UTC+2, which it was then: in winter it may be another.
export const zone = (ms) =>
  ZONE.formatToParts(ms).find((part) => part.type === "timeZoneName").value.replace("GMT", "UTC").replace(/[+-]0$/, "");

// With the day, where it is not today.
export const spoken = (ms, now = Date.now()) => (DAY.format(ms) === DAY.format(now) ? CLOCK : FULL).format(ms);

export function length(seconds) {
  const round = (value) => Number(value.toPrecision(2));
  if (seconds < 60) return `${round(seconds)} s`;
  if (seconds < 3600) return `${round(seconds / 60)} min`;
  return seconds < 86400 ? `${round(seconds / 3600)} h` : `${round(seconds / 86400)} d`;
}

// Where a scale has its marks: [{ ms, words }], no more than `most`.
export function marks(sinceMs, untilMs, most) {
  const span = untilMs - sinceMs;
  const step = 1000 * (STEPS_S.find((each) => span / (1000 * each) <= most) ?? STEPS_S.at(-1));
  const ahead = new Date(sinceMs).getTimezoneOffset() * 60000;
  const found = [];
  for (let ms = Math.ceil((sinceMs - ahead) / step) * step + ahead; ms <= untilMs; ms += step) {
    const words = step >= DAY_MS || new Date(ms).getHours() + new Date(ms).getMinutes() + new Date(ms).getSeconds() === 0 ? DAY : step < 60000 ? CLOCK : SHORT;
    found.push({ ms, words: words.format(ms) });
  }
  return found;
}
