// Which number of groups scores best: scores of numbers as the station tells them, the smallest number first.
const AS_GOOD = 1e-9;

// { groups, score }, of two as good the one with fewer groups; null where no number was looked at.
export const bestOf = (scores) =>
  scores.length ? scores.reduce((best, each) => (each.score > best.score + AS_GOOD ? each : best)) : null;
