/** Have the browser keep the site, so that each of its pages opens without a network. */
export function keepOffline() {
  if (navigator.serviceWorker && isSecureContext) navigator.serviceWorker.register("./service_worker.js");
}
