// What is chosen on a page, in its address: so that it can be sent to somebody.
// Browsers refuse to write it too often (Safari: a hundred times in half a minute).
const PAUSE_MS = 350;

let [wanted, timer] = [null, null];

export const chosenIn = (name) => new URL(location.href).searchParams.get(name);

export function choose(values) {
  const url = new URL(wanted ?? location.href);
  for (const [name, value] of Object.entries(values)) {
    if (value === null || value === undefined || value === "") url.searchParams.delete(name);
    else url.searchParams.set(name, value);
  }
  write(url.href);
}

// At once, or the last of many after a pause.
export function write(address) {
  wanted = new URL(address, location.href).href;
  if (timer !== null) return;
  settle();
  timer = setTimeout(() => {
    timer = null;
    if (wanted !== null) write(wanted);
  }, PAUSE_MS);
}

function settle() {
  if (wanted !== null && wanted !== location.href) history.replaceState(history.state, "", wanted);
  wanted = null;
}
addEventListener("pagehide", settle);
