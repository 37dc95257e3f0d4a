let registered = null;

/**
 * Make the browser keep the site: then each page opens without a network. Files that a page loads on demand (see LATER
 * in web/site.py) are kept from their first use on. Resolves to true when the site is kept, to false if that is
 * impossible: without https, except on this computer's own address.
 */
export async function keepOffline() {
  if (!navigator.serviceWorker || !isSecureContext) return false;
  registered = navigator.serviceWorker.register("./service_worker.js").catch(() => null); // the settings may forbid it
  if (!(await registered)) return false;
  await navigator.serviceWorker.ready;
  return true;
}

const LONGEST_MS = 5000;

/** Wait until files fetched by the page will be kept. If that is impossible, wait only a short time. */
export async function keptOffline() {
  if (!(await registered) || navigator.serviceWorker.controller) return;
  await new Promise((done) => {
    navigator.serviceWorker.addEventListener("controllerchange", done, { once: true });
    setTimeout(done, LONGEST_MS);
  });
}
