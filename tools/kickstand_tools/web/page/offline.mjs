let registered = null;

/** Have the browser keep the site, so that each of its pages opens without a network. */
export function keepOffline() {
  if (!navigator.serviceWorker || !isSecureContext) return;
  registered = navigator.serviceWorker.register("./service_worker.js").catch(() => null); // a browser may be set to keep nothing
}

const LONGEST_MS = 5000;

/** Wait until what the page fetches is kept, or for a while where that cannot be. */
export async function keptOffline() {
  if (!(await registered) || navigator.serviceWorker.controller) return;
  await new Promise((done) => {
    navigator.serviceWorker.addEventListener("controllerchange", done, { once: true });
    setTimeout(done, LONGEST_MS);
  });
}
