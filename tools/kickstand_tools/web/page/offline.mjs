let registered = null;

/**
 * Make the browser keep the site, so each page opens without a network. Files that a page loads on demand (see LATER in
 * web/site.py) are kept after their first use. Resolves to true when the site is kept. Resolves to false if the browser
 * cannot keep it, because the page came without https from another computer.
 */
export async function keepOffline() {
  if (!navigator.serviceWorker || !isSecureContext) return false;
  registered = navigator.serviceWorker.register("./service_worker.js").catch(() => null); // the settings may forbid it
  if (!(await registered)) return false;
  await navigator.serviceWorker.ready;
  return true;
}

const LONGEST_MS = 5000;

/** Wait until the browser keeps the files that the page fetches. If it cannot keep them, wait only a short time. */
export async function keptOffline() {
  if (!(await registered) || navigator.serviceWorker.controller) return;
  await new Promise((done) => {
    navigator.serviceWorker.addEventListener("controllerchange", done, { once: true });
    setTimeout(done, LONGEST_MS);
  });
}
