// Loads CPython for WebAssembly for the pages that use the command-line tools.

import { fetchedAll } from "./fetched.mjs";
import { loadPyodide } from "./pyodide/pyodide.mjs";

// Files that Pyodide fetches. Pyodide waits forever for a missing file, so this module fetches them first.
const PARTS = ["pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json"];
const HERE = new URL("./", import.meta.url);
export const PACKAGES = "/packages"; // folder of the unpacked archives

/** Start a new Python. archives: ZIP files of the site from which it can import. tell(done, of): see fetchedAll(). */
export async function loadPython(archives, tell) {
  const come = await fetchedAll([...archives, ...PARTS.map((name) => `pyodide/${name}`)], HERE, tell);
  const packed = come.slice(0, archives.length);
  const python = await loadPyodide({ indexURL: new URL("./pyodide/", HERE).href });
  // numpy calls backtrace(), which Pyodide lacks, to find out whether it may avoid copying an array. If backtrace()
  // returns 0 callers, numpy copies the array.
  python._module.LDSO.loadedLibsByName["__main__"].exports.backtrace = () => 0;
  for (const archive of packed) python.unpackArchive(archive, "zip", { extractDir: PACKAGES });
  python.runPython(`import sys; sys.path.insert(0, "${PACKAGES}")`);
  return python;
}
