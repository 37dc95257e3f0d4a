// Runs the command-line tools in a separate thread.
//
// Receives these messages:
//     {files}: the files that were given to the page.
//     {call: [name, ...arguments]}: call a function of web/browser_rides.py.
// Sends these messages:
//     {done, of, loading}: the progress of fetching the tools if loading is true, otherwise of a call.
//     {ready}: the tools are fetched.
//     {said}: the result of a call. With {made}, the file that the call made.
//     {failed: text}: the reason for a failure.

import { loadPython } from "../python.mjs";

const GIVEN = "/given";
const HERE = "/ride"; // Python's working directory
const OFTEN_MS = 100; // time between two messages about the progress

let module;
let python;
let mounted = false;
let saidMs = 0;

function tell(done, total, loading = false) {
  const nowMs = performance.now();
  if (nowMs - saidMs < OFTEN_MS) return;
  saidMs = nowMs;
  postMessage({ done, of: total, loading });
}

async function load() {
  python = await loadPython(["numpy/numpy.zip", "rides.zip"], (done, of) => tell(done, of, true));
  for (const folder of [GIVEN, HERE]) python.FS.mkdir(folder);
  python.FS.chdir(HERE);
  module = python.pyimport("kickstand_tools.web.browser_rides");
  module.prepare();
  postMessage({ ready: true });
}

/** Mount the files, so Python reads them in parts instead of copying a whole file into memory. */
function give(files) {
  if (mounted) python.FS.unmount(GIVEN);
  mounted = true;
  python.FS.mount(python.FS.filesystems.WORKERFS, { files }, GIVEN);
}

function call([name, ...given]) {
  const said = JSON.parse(name === "rides" ? module.rides(GIVEN, ...given) : module[name](...given, tell));
  const made = said.path && python.FS.readFile(said.path);
  postMessage({ said, made }, made ? [made.buffer] : []);
}

const loaded = load();
loaded.catch(failed);

function failed(error) {
  postMessage({ failed: String(error.message ?? error).trim().split("\n").at(-1) });
}

onmessage = async ({ data }) => {
  try {
    await loaded;
  } catch {
    return; // the failure was already reported
  }
  try {
    if (data.files) give(data.files);
    else call(data.call);
  } catch (error) {
    failed(error);
  }
};
