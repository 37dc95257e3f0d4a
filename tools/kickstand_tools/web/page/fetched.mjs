// Fetches files of the site for the pages.

/** Fetch a file and return the Response. Throws an Error with one sentence if the site does not deliver the file. */
export async function fetched(url) {
  const answer = await fetch(url).catch(() => null);
  if (!answer) throw new Error(`${url} cannot be loaded: the server does not answer`);
  if (!answer.ok) throw new Error(`${url} cannot be loaded (HTTP ${answer.status})`);
  return answer;
}

/** Fetch files of the site and return their bytes in the same order. tell(done, of) is called with the progress in
 * bytes. The total is from sizes.json, because a server may compress files. */
export async function fetchedAll(names, base, tell = () => {}) {
  const sizes = await (await fetched(new URL("sizes.json", base))).json();
  const of = names.reduce((sum, name) => sum + sizes[name], 0);
  let done = 0;
  return Promise.all(
    names.map(async (name) => {
      const { body } = await fetched(new URL(name, base));
      const chunks = [];
      for (const reader = body.getReader(); ; ) {
        const { value, done: ended } = await reader.read();
        if (ended) break;
        chunks.push(value);
        tell((done += value.length), of);
      }
      return new Blob(chunks).arrayBuffer();
    }),
  );
}
