// What is chosen on a page, in its address: so that it can be sent to somebody.

// Browsers take some one or two hundred addresses in half a minute, and who drags a slider makes more.
const LEAST_MS = 350;

let [timer, waiting] = [null, null];

export const chosenIn = (name) => new URL(waiting ?? location.href, location.href).searchParams.get(name);

// The first at once, those that come soon after it as one.
export function write(url) {
  waiting = url;
  if (timer !== null) return;
  settle();
  timer = setTimeout(() => {
    timer = null;
    if (waiting !== null) write(waiting);
  }, LEAST_MS);
}

function settle() {
  const wanted = waiting;
  waiting = null;
  if (wanted === null || new URL(wanted, location.href).href === location.href) return;
  try {
    history.replaceState(history.state, "", wanted);
  } catch {
    // The browser has had enough for now: with the next round.
    waiting = wanted;
  }
}

// Who leaves finds it again on the way back.
addEventListener("pagehide", settle);

export function choose(values) {
  const url = new URL(waiting ?? location.href, location.href);
  for (const [name, value] of Object.entries(values)) {
    if (value === null || value === undefined || value === "") url.searchParams.delete(name);
    else url.searchParams.set(name, value);
  }
  write(url.href);
}
