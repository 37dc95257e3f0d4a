// Rides that the page Live has read from a board: it leaves them in the browser's store, and opens the page Rides as
// rides.html#pulled.

const NAME = "pulled";

/** files: [{name, data: Uint8Array}]. Throws an Error where the browser does not keep them. */
export async function leavePulled(files) {
  const given = files.map(({ name, data }) => ({ name, data: data.slice().buffer }));
  await inStore((store) => store.put(given, NAME));
}

/** The files, and none of them is left in the store. Empty where there are none. */
export async function takePulled() {
  const found = await inStore((store) => {
    const reading = store.get(NAME);
    store.delete(NAME);
    return reading;
  });
  return (found ?? []).map(({ name, data }) => new File([data], name));
}

/** The result of the request that begin(store) makes, once all is done. */
async function inStore(begin) {
  const opening = indexedDB.open("kickstand", 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore("files");
  const database = await new Promise((resolve, reject) => {
    opening.onsuccess = () => resolve(opening.result);
    opening.onerror = () => reject(opening.error);
  });
  try {
    const transaction = database.transaction("files", "readwrite");
    const request = begin(transaction.objectStore("files"));
    await new Promise((resolve, reject) => {
      transaction.oncomplete = resolve;
      transaction.onabort = () => reject(transaction.error); // the disk may be full
    });
    return request.result;
  } finally {
    database.close();
  }
}
