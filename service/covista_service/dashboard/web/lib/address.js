// What is chosen on a page, in its address: so that it can be sent to somebody.
export const chosenIn = (name) => new URL(location.href).searchParams.get(name);

export function choose(values) {
  const url = new URL(location.href);
  for (const [name, value] of Object.entries(values)) {
    if (value === null || value === undefined || value === "") url.searchParams.delete(name);
    else url.searchParams.set(name, value);
  }
  if (url.href !== location.href) history.replaceState(history.state, "", url);
}
