(files) => new Promise((done) => {
  const opening = indexedDB.open("kickstand", 1);
  opening.onupgradeneeded = () => opening.result.createObjectStore("files");
  opening.onsuccess = () => {
    const work = opening.result.transaction("files", "readwrite");
    const all = files.map(([name, text]) => ({ name, data: new TextEncoder().encode(text).buffer }));
    work.objectStore("files").put(all, "pulled");
    work.oncomplete = () => { opening.result.close(); done(); };
  };
})
