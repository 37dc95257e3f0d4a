// The command-line tools, outside the page's own thread.
//
// Receives {files}: the files given to the page, and {call: [name, ...arguments]}: a function of web/rides_guest.py.
// Sends {done, of}: the progress of a call, or with {loading} of fetching the tools, {ready} after that, {said}: a
// call's result, {failed: text}, and {made}: the file that a call made.

import { loadPython } from "../python.mjs";

const GIVEN = "/given";
const HERE = "/ride"; // Python's working directory
const OFTEN_MS = 100; // between two messages of progress

let guest;
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
  guest = python.pyimport("kickstand_tools.web.rides_guest");
  guest.prepare();
  postMessage({ ready: true });
}

/** Mount the files: Python reads them in parts, and none is copied into its memory as a whole. */
function give(files) {
  if (mounted) python.FS.unmount(GIVEN);
  mounted = true;
  python.FS.mount(python.FS.filesystems.WORKERFS, { files }, GIVEN);
}

function call([name, ...given]) {
  const said = JSON.parse(name === "rides" ? guest.rides(GIVEN, ...given) : guest[name](...given, tell));
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
