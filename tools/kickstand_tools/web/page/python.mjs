// CPython for WebAssembly, for the pages that use the command-line tools.

import { fetchedAll } from "./fetched.mjs";
import { loadPyodide } from "./pyodide/pyodide.mjs";

// Files that Pyodide fetches. If one is missing it waits for ever, so they are fetched in advance.
const PARTS = ["pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json"];
const HERE = new URL("./", import.meta.url);
export const PACKAGES = "/packages"; // their folder

/** A new Python. archives: ZIP files of the site, whose content can be imported. tell(done, of): see fetchedAll(). */
export async function loadPython(archives, tell) {
  const come = await fetchedAll([...archives, ...PARTS.map((name) => `pyodide/${name}`)], HERE, tell);
  const packed = come.slice(0, archives.length);
  const python = await loadPyodide({ indexURL: new URL("./pyodide/", HERE).href });
  // numpy checks its callers before it avoids a copy. Pyodide has no backtrace(); 0 callers means: make the copy.
  python._module.LDSO.loadedLibsByName["__main__"].exports.backtrace = () => 0;
  for (const archive of packed) python.unpackArchive(archive, "zip", { extractDir: PACKAGES });
  python.runPython(`import sys; sys.path.insert(0, "${PACKAGES}")`);
  return python;
}
