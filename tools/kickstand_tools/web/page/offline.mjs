let registered = null;

/**
 * Have the browser keep the site, so that each of its pages opens without a network. What a page loads only when it is
 * used (see LATER in web/site.py) is kept from its first use on. Resolves to true once it is so, to false where it cannot
 * be: without https, except on this computer's own address.
 */
export async function keepOffline() {
  if (!navigator.serviceWorker || !isSecureContext) return false;
  registered = navigator.serviceWorker.register("./service_worker.js").catch(() => null); // a browser may be set to keep nothing
  if (!(await registered)) return false;
  await navigator.serviceWorker.ready;
  return true;
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
