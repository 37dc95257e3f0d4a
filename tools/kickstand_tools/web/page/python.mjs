// CPython for WebAssembly, for the pages whose work the tools of the command line do.

import { fetchedAll } from "./fetched.mjs";
import { loadPyodide } from "./pyodide/pyodide.mjs";

// What Pyodide fetches. Where one of these does not come it waits for ever, so they are fetched before it asks for them.
const PARTS = ["pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json"];
const HERE = new URL("./", import.meta.url);
export const PACKAGES = "/packages"; // where they are

/** A new Python. archives: ZIP files of the site; what is in them can be imported. tell(done, of): of fetchedAll(). */
export async function loadPython(archives, tell) {
  const come = await fetchedAll([...archives, ...PARTS.map((name) => `pyodide/${name}`)], HERE, tell);
  const packed = come.slice(0, archives.length);
  const python = await loadPyodide({ indexURL: new URL("./pyodide/", HERE).href });
  // numpy looks at its callers before it saves a copy. Pyodide has no backtrace(); 0 callers found means: do not save it.
  python._module.LDSO.loadedLibsByName["__main__"].exports.backtrace = () => 0;
  for (const archive of packed) python.unpackArchive(archive, "zip", { extractDir: PACKAGES });
  python.runPython(`import sys; sys.path.insert(0, "${PACKAGES}")`);
  return python;
}
