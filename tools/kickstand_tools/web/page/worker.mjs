// Runs the board (firmware and models on MicroPython) in real time, in a separate thread.
//
// Receives these messages:
//     {order: [name, value]}: an order, see PageDevice.act() in web/device.py.
//     {ahead: [[s, name, value], ...]}: orders that are carried out at these board times, as fast as possible.
//     {awake: boolean}: whether the board's time advances.
// Sends these messages:
//     {ready}: the board has started.
//     {ticks}: the result of Device.take().
//     {rate}: the board's pace, in seconds per second. It is below 1 if the browser is too slow.
//     {orders}: the orders with the board time of each, so they can be repeated.
//     {failed: text}: the reason for a failure.

import { fetched } from "./fetched.mjs";
import { loadMicroPython } from "./micropython/micropython.mjs";

const PAUSE_MS = 8; // pause between two steps
const SLICE_S = 0.1; // the board's time in one slice; garbage is collected only between two slices
const LATE_S = 0.2; // after a longer delay the board does not catch up
const RATE_MS = 2000; // the pace is measured over this time

let device; // the device's functions, looked up once because each look-up creates a new function
let boardS = 0; // the board's time
let beganMs; // the value of performance.now() at the board's time 0, computed
let awake = true;
let waiting = []; // ticks of a start; they are computed at once, but shown in real time
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
  micropython.FS.mkdir("/flash"); // the board's flash: calibration and rides
  micropython.FS.chdir("/flash");
  micropython.runPython("import sys; sys.path.insert(0, '/lib')");
  const made = micropython.pyimport("kickstand_tools.web.device").PageDevice();
  device = { order: made.order, run_to: made.run_to, take: made.take };
}

/** Report that the site does not deliver the .wasm file, because MicroPython's own message is unclear. */
async function missing(error) {
  await fetched("./micropython/micropython.wasm");
  throw error;
}

/** Advance the board's time to real time, and send what the board shows. */
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

/** Advance the board's time beyond real time, up to the last of these orders. */
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
