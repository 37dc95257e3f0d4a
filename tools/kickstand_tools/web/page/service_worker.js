// Keeps the whole site in the browser, so it opens without a network. web/site.py fills in the two texts below when it
// builds the site. A new version is fetched in the background and shown at the next visit.

const FILES = {{ files | tojson }};
const VERSION = {{ version | tojson }};
const CACHE = `kickstand-${VERSION}`;

addEventListener("install", (event) => {
  event.waitUntil(keep());
});

addEventListener("activate", (event) => {
  event.waitUntil(forget());
});

addEventListener("fetch", (event) => {
  if (event.request.method === "GET") event.respondWith(answer(event.request));
});

async function keep() {
  const cache = await caches.open(CACHE);
  await cache.addAll(FILES.map((name) => new Request(name, { cache: "reload" })));
  await skipWaiting();
}

async function forget() {
  for (const name of await caches.keys()) {
    if (name.startsWith("kickstand-") && name !== CACHE) await caches.delete(name);
  }
  await clients.claim();
}

async function answer(request) {
  const cache = await caches.open(CACHE);
  const kept = await cache.match(named(request), { ignoreSearch: true });
  if (kept) return kept;
  const fetched = await fetch(request);
  if (fetched.ok) {
    // Keep a file that a page loads on demand. If the browser has no space, the file is fetched again each time.
    await cache.put(request, fetched.clone()).catch(() => {});
  }
  return fetched;
}

/** Return the address under which a page is kept. It omits the first page's name, because some servers redirect it. */
function named(request) {
  const { pathname } = new URL(request.url);
  return pathname === new URL("./index.html", location).pathname ? "./" : request;
}
