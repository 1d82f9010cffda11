// In which order the robots of a matrix are shown: group by group, those of no group last.
import { byLabel, byName } from "covista/looks.js";

// Places (indices into `robots`) in order, and the blocks that they form: { label, first, end }.
export function orderOf(robots, groups) {
  const place = new Map(robots.map((name, k) => [name, k]));
  const order = [];
  const blocks = [];
  const add = (label, members) => {
    const found = members.filter((name) => place.has(name));
    if (!found.length) return;
    blocks.push({ label, first: order.length, end: order.length + found.length });
    for (const name of found) {
      order.push(place.get(name));
      place.delete(name);
    }
  };
  for (const { label, robots: members } of [...groups].sort((p, q) => byLabel(p.label, q.label))) add(label, members);
  add(null, [...place.keys()].sort(byName));
  return { order, blocks };
}
