// The board: firmware and models on MicroPython, kept to real time, away from the page's own thread.
//
// Takes {order: [name, value]}, see Device.act() in web/device.py, {ahead: [[s, name, value], ...]}: orders that are
// carried out at these times of the board, as fast as it can, and {awake: boolean}.
// Sends {ready}, {ticks} as Device.take() gives them, {rate}: the board's seconds a second, if not all in time less than
// 1, {orders} with the board's time of each, for whoever wants to repeat them, and {failed: text}.

import { fetched } from "./fetched.mjs";
import { loadMicroPython } from "./micropython/micropython.mjs";

const PAUSE_MS = 8; // between two looks at the time
const SLICE_S = 0.1; // of the board's time at once: garbage is collected only between two slices
const LATE_S = 0.2; // a browser that was busy for longer does not race to catch up
const RATE_MS = 2000; // over which the pace is measured

let device; // its functions: each look-up would make a new one
let boardS = 0; // up to where the board's time has come
let beganMs; // what performance.now() was, or would have been, when the board's time was 0
let awake = true;
let waiting = []; // ticks of a start, which is computed at once: they are shown in their own time
let lostS = 0;
let ratedMs;

async function load() {
  const [micropython, python] = await Promise.all([
    loadMicroPython({ stdout: (line) => console.log(line), linebuffer: true }).catch(missing),
    fetched("./python.json").then((answer) => answer.json()),
  ]);
  const folders = new Set();
  for (const [name, source] of Object.entries(python)) {
    const parts = `lib/${name}`.split("/");
    for (let depth = 1; depth < parts.length; depth++) {
      const folder = parts.slice(0, depth).join("/");
      if (!folders.has(folder)) micropython.FS.mkdir(`/${folder}`);
      folders.add(folder);
    }
    micropython.FS.writeFile(`/lib/${name}`, source);
  }
  micropython.FS.mkdir("/flash"); // of the board: calibration and rides
  micropython.FS.chdir("/flash");
  micropython.runPython("import sys; sys.path.insert(0, '/lib')");
  const made = micropython.pyimport("kickstand_tools.web.device").PageDevice();
  device = { order: made.order, run_to: made.run_to, take: made.take };
}

/** MicroPython says in a puzzle that the site does not give its .wasm file. */
async function missing(error) {
  await fetched("./micropython/micropython.wasm");
  throw error;
}

/** Let the board's time follow ours, and send what is to be seen. */
function go() {
  try {
    if (awake) follow();
    setTimeout(go, PAUSE_MS);
  } catch (error) {
    stop(error);
  }
}

function follow() {
  const nowMs = performance.now();
  let dueS = (nowMs - beganMs) / 1000;
  if (dueS > boardS + LATE_S) {
    lostS += dueS - boardS;
    beganMs = nowMs - boardS * 1000;
    dueS = boardS;
  }
  while (boardS < dueS) {
    boardS = Math.min(dueS, boardS + SLICE_S);
    device.run_to(boardS);
  }
  waiting.push(...JSON.parse(device.take()));
  const later = waiting.findIndex((tick) => tick.t_s > dueS);
  const message = { ticks: waiting.splice(0, later < 0 ? waiting.length : later) };
  if (nowMs - ratedMs > RATE_MS) {
    message.rate = 1 - (1000 * lostS) / (nowMs - ratedMs);
    lostS = 0;
    ratedMs = nowMs;
  }
  if (message.ticks.length || message.rate !== undefined) postMessage(message);
}

/** Let the board's time run ahead of ours, up to the last of these orders. */
function runAhead(orders) {
  for (const [atS, name, value] of orders) {
    while (boardS < atS) {
      boardS = Math.min(atS, boardS + SLICE_S);
      device.run_to(boardS);
    }
    device.order(name, value);
  }
  waiting = JSON.parse(device.take()).slice(-1);
  start();
}

function start() {
  beganMs = performance.now() - boardS * 1000;
  ratedMs = performance.now();
  lostS = 0;
}

function stop(error) {
  device = null;
  postMessage({ failed: String(error.message ?? error) });
}

onmessage = ({ data }) => {
  if (!device) return;
  if (data.order) postMessage({ orders: [[device.order(...data.order), ...data.order]] });
  if (data.ahead) runAhead(data.ahead);
  if (data.awake !== undefined) {
    awake = data.awake;
    if (awake) start();
  }
};

load().then(() => {
  postMessage({ ready: true });
  start();
  go();
}, stop);
