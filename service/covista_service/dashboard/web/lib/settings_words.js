// Live settings by flat name (hysteresis.gain): as words, in an address, as the body of a patch.
const PARTED = "hysteresis";
const RANGE = /^(\d+)-(\d+)$/;

export function flat(settings) {
  const { [PARTED]: parts, ...whole } = settings;
  return { ...whole, ...Object.fromEntries(Object.entries(parts).map(([part, value]) => [`${PARTED}.${part}`, value])) };
}

// Changes, each with a name and a value, as REST takes them.
export function patchOf(changes) {
  const body = {};
  for (const { name, value } of changes) {
    const [whole, part] = name.split(".");
    if (part) body[whole] = { ...body[whole], [part]: value };
    else body[whole] = value;
  }
  return body;
}

export const isRange = (value) => typeof value === "object" && value !== null;
export const same = (a, b) => (isRange(a) && isRange(b) ? a.min === b.min && a.max === b.max : a === b);

export function word(value) {
  if (isRange(value)) return `${value.min} to ${value.max}`;
  return typeof value === "number" ? `${Number(value.toPrecision(6))}` : value;
}

// "alpha is 0.7, was 0.5", as the station's own events have it.
export const says = ({ name, value, was }) => `${name} is ${word(value)}, was ${word(was)}`;

// What is different between two, as changes.
export const differing = (before, after) =>
  Object.keys(after)
    .filter((name) => !same(before[name], after[name]))
    .map((name) => ({ name, value: after[name], was: before[name] }));

export const toAddress = (value) => (isRange(value) ? `${value.min}-${value.max}` : `${value}`);

const within = (choice, number, whole) =>
  Number.isFinite(number) && (!whole || Number.isInteger(number)) && number <= (choice.most ?? Infinity) &&
  (choice.above ? number > choice.least : number >= (choice.least ?? -Infinity));

// The value that an address names, undefined where that is none.
export function fromAddress(choice, text) {
  const number = text.trim() === "" ? NaN : Number(text);
  const named = choice.options.some((option) => option.value === text);
  switch (choice.kind) {
    case "groups": {
      if (text === "auto") return text;
      const [, min, max] = (RANGE.exec(text) ?? []).map(Number);
      if (min !== undefined) return within(choice, min, true) && within(choice, max, true) ? { min, max } : undefined;
      return within(choice, number, true) ? number : undefined;
    }
    case "sigma":
      return named && text !== "metres" ? text : within(choice, number, false) ? number : undefined;
    case "choice":
      return named ? text : undefined;
    default:
      return within(choice, number, choice.kind === "count") ? number : undefined;
  }
}
