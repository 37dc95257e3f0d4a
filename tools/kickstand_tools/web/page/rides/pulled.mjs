// Rides that another page of the site has read from a board: it leaves them in the browser's store, and opens this page
// as rides.html#pulled.

/** The files, and none of them is left in the store. Empty where there are none. */
export async function takePulled() {
  const store = await new Promise((resolve, reject) => {
    const opening = indexedDB.open("kickstand", 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore("files");
    opening.onsuccess = () => resolve(opening.result);
    opening.onerror = () => reject(opening.error);
  });
  try {
    const work = store.transaction("files", "readwrite").objectStore("files");
    const found = await new Promise((resolve, reject) => {
      const reading = work.get("pulled");
      reading.onsuccess = () => resolve(reading.result ?? []);
      reading.onerror = () => reject(reading.error);
      work.delete("pulled");
    });
    return found.map(({ name, data }) => new File([data], name));
  } finally {
    store.close();
  }
}
