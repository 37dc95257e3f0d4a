// Passes rides from the page Live to the page Rides: Live leaves them in the browser's store and opens
// rides.html#pulled.

const NAME = "pulled";

/** Store files: [{name, data: Uint8Array}]. Throws an Error if the browser does not store them. */
export async function leavePulled(files) {
  const given = files.map(({ name, data }) => ({ name, data: data.slice().buffer }));
  await inStore((store) => store.put(given, NAME));
}

/** Return the files and remove them from the store. The list is empty without files. */
export async function takePulled() {
  const found = await inStore((store) => {
    const reading = store.get(NAME);
    store.delete(NAME);
    return reading;
  });
  return (found ?? []).map(({ name, data }) => new File([data], name));
}

/** Return the result of the request that begin(store) makes, when the transaction is complete. */
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
