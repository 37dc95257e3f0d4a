// CPython for WebAssembly, for the pages whose work the tools of the command line do.

import { fetched } from "./fetched.mjs";
import { loadPyodide } from "./pyodide/pyodide.mjs";

const HERE = new URL("./", import.meta.url);
export const PACKAGES = "/packages"; // where they are

/** A new Python. archives: ZIP files of the site; what is in them can be imported. */
export async function loadPython(archives) {
  const [python, ...packed] = await Promise.all([
    loadPyodide({ indexURL: new URL("./pyodide/", HERE).href }),
    ...archives.map((name) => fetched(new URL(name, HERE)).then((answer) => answer.arrayBuffer())),
  ]);
  // numpy looks at its callers before it saves a copy. Pyodide has no backtrace(); 0 callers found means: do not save it.
  python._module.LDSO.loadedLibsByName["__main__"].exports.backtrace = () => 0;
  for (const archive of packed) python.unpackArchive(archive, "zip", { extractDir: PACKAGES });
  python.runPython(`import sys; sys.path.insert(0, "${PACKAGES}")`);
  return python;
}
