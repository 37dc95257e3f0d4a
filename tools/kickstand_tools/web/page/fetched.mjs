// What the pages fetch of the site.

/** The Response. Throws an Error, one sentence, where the site does not give the file. */
export async function fetched(url) {
  const answer = await fetch(url).catch(() => null);
  if (!answer) throw new Error(`${url} cannot be loaded: the server does not answer`);
  if (!answer.ok) throw new Error(`${url} cannot be loaded (HTTP ${answer.status})`);
  return answer;
}
