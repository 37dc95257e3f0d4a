// Shows a board's stream, keeps it as a log, and fetches recorded rides from the board. It runs `kickstand record` and
// `kickstand pull` on CPython for WebAssembly (web/browser_board.py).

import { ASKING, choosePort, loadOnce, overCable, python, showShare } from "../cable/cable.mjs";
import { keepOffline } from "../offline.mjs";
import { Riding } from "./bluetooth/riding.mjs";
import { Chart } from "./chart.mjs";
import { busy, offer } from "./files.mjs";
import { Gauge } from "./gauge.mjs";
import { LEAN, SIDEWAYS, sideOf, signed, written } from "./measures.mjs";
import { Player } from "./player.mjs";
import { SimulatedRide } from "./simulated.mjs";

const byId = (id) => document.getElementById(id);
const gauge = new Gauge(byId("gauge"));
const chart = new Chart(byId("chart"));
const player = new Player();
const modules = loadOnce(async () => (await python(true)).pyimport("kickstand_tools.web.browser_board"));
let live; // the LiveStream of browser_board.py, or null
let stopped = false;
let awake = null; // a WakeLockSentinel
let aligned = false;
let measure = null; // LEAN or SIDEWAYS
let furthest = [0, 0];
let riding = null; // the running Riding, or null

const tell = (text) => (byId("live-said").textContent = text);

/** Listen until the rider stops it or the board is gone. A new alignment starts a new log. */
async function start() {
  const port = await choosePort(tell);
  if (!port) return;
  stopped = false;
  atWork(true);
  tell("Loading the tools, 8 MB the first time …");
  const module = await modules(tell);
  if (!module) return atWork(false);
  await stayAwake();
  let said = null;
  for (let again = false; !stopped; again = true) {
    player.restart();
    furthest = [0, 0];
    tell("The board starts …");
    live = module.LiveStream();
    said = JSON.parse(await overCable(port, tell, (line, name) => live.run.callPromising(line, name, received), again));
    keep(live);
    live = null;
    if (!said?.changed) break;
  }
  awake?.release();
  atWork(false);
  if (!said && stopped) tell("Stopped.");
  if (said) tell(sentences(said.refused ? [said.refused] : ["Stopped", ...said.notes]));
}

/** Keep the screen on if the browser can. The browser lets the screen turn off when the page is hidden. */
async function stayAwake() {
  awake = await navigator.wakeLock?.request("screen").catch(() => null);
}

/** Show the figures and the chart, which are hidden until the first value arrives. */
const watch = () => (document.documentElement.dataset.watching = "yes");

function received(text) {
  const reading = JSON.parse(text);
  watch();
  aligned = reading.aligned;
  show(reading.car ? SIDEWAYS : LEAN);
  furthest = measure.most(reading);
  player.take(reading.moments, performance.now());
  const lacking = aligned ? "" : `; the board is not aligned yet, so there is ${measure.none}`;
  if (!stopped) tell(`Recording${lacking}: ${clock(reading.seconds)}`);
}

/** Functions with which an object of the class Riding shows values on this page. */
const shown = {
  begin() {
    player.restart();
    furthest = [0, 0];
  },
  measure: show,
  moment(moment) {
    watch();
    player.take([moment], performance.now());
  },
  furthest: (ride) => (furthest = measure.most(ride)),
};

async function ride() {
  await stayAwake(); // called first, because a browser may allow it only directly after a button press
  riding = new Riding(shown);
  await riding.run();
  riding = null;
  awake?.release();
}

let simulated = null; // the running SimulatedRide

function simulate() {
  shown.begin();
  document.documentElement.dataset.simulated = "yes";
  byId("simulated-stop").focus();
  shown.measure(LEAN);
  simulated = new SimulatedRide(shown, (text) => put("pretend-said", text));
  simulated.start();
}

function endSimulated() {
  simulated.stop();
  shown.begin();
  for (const state of ["simulated", "watching"]) delete document.documentElement.dataset[state];
  byId("simulated").focus();
}

function stop() {
  stopped = true;
  live?.stop();
  tell("Stopping …");
}

function keep(live) {
  const files = byName(live.files());
  if (files.length) offer(byId("files"), `Live, until ${new Date().toLocaleTimeString()}`, files);
}

async function pull() {
  const say = (text, share = null) => {
    byId("pull-said").textContent = text;
    showShare(byId("pull-bar"), share);
  };
  const port = await choosePort(say);
  if (!port) return;
  atWork(true, false);
  say("Loading the tools, 8 MB the first time …", 0);
  const module = await modules(say);
  if (!module) return atWork(false);
  const result = await overCable(port, say, (line, name) => {
    say(ASKING, NaN);
    return module.pull.callPromising(line, name, (what, done, total) => say(what, total ? done / total : 0));
  });
  atWork(false);
  if (!result) return;
  const { refused, rides } = JSON.parse(result.get(0));
  const files = byName(result.get(1));
  for (const { number, log, seconds, readings } of rides) {
    const stem = log?.replace(".csv.gz", "");
    const title = `Ride ${number}: ${clock(seconds)}, ${readings} readings`;
    if (log) offer(byId("files"), title, files.filter(({ name }) => name.startsWith(`${stem}.`)));
  }
  const problems = [...rides.flatMap((ride) => ride.problems), ...(refused ? [refused] : [])];
  const none = refused ? "" : "There are no rides on the board: its menu’s “Record ride” makes one";
  const some =
    rides.length === 1
      ? "1 ride is here: save it. It stays on the board too"
      : `${rides.length} rides are here: save them. They stay on the board too`;
  const sum = rides.length ? some : none;
  say(sentences([sum, ...problems].filter(Boolean)));
}

/** Join the lines of a command to one text. */
function sentences(lines) {
  return lines.map((line) => line.replace(/^./, (first) => first.toUpperCase())).join(". ") + ".";
}

/** Convert Python's [(name, bytes)] to [{name, data}]. */
function byName(list) {
  return list.toJs().map(([name, data]) => ({ name, data }));
}

function atWork(on, listening = on) {
  for (const id of ["start", "pull"]) byId(id).disabled = on;
  byId("start").hidden = listening;
  byId("stop").hidden = !listening;
  busy(on);
}

function clock(seconds) {
  return `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
}

/** Show this measure of measures.mjs from now on. */
function show(wanted) {
  if (wanted === measure) return;
  measure = wanted;
  gauge.scale(measure);
  put("now-title", measure.title);
  byId("lean").classList.toggle("long", measure === SIDEWAYS);
  put("max-left-name", measure.furthest[0]);
  put("max-right-name", measure.furthest[1]);
  byId("chart").setAttribute("aria-label", `${measure.title.split(" ")[0]} and acceleration over the last minute`);
  drawn = null;
}

let drawn = null;

function draw(nowMs) {
  const { moment, until } = player.now(nowMs);
  const key = `${moment} ${until} ${innerWidth} ${matchMedia("(prefers-color-scheme: dark)").matches}`;
  if (key !== drawn) {
    drawn = key;
    const value = moment && measure.value(moment);
    const forward = moment ? moment[2] : null;
    gauge.show(value, ...(measure === LEAN ? furthest : [0, 0]));
    chart.draw(player.moments, until, measure);
    put("lean", value === null ? "--" : written(measure, value));
    put("side", (value !== null && sideOf(measure, value)) || "\u00a0");
    put("forward", forward === null ? "--" : `${signed(forward)} g`);
    put("max-left", furthest[0] ? written(measure, furthest[0]) : "--");
    put("max-right", furthest[1] ? written(measure, furthest[1]) : "--");
  }
  requestAnimationFrame(draw);
}

function put(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

show(LEAN);
byId("start").addEventListener("click", start);
byId("stop").addEventListener("click", stop);
byId("pull").addEventListener("click", pull);
byId("simulated").addEventListener("click", simulate);
byId("simulated-stop").addEventListener("click", endSimulated);
byId("ride").addEventListener("click", ride);
byId("ride-stop").addEventListener("click", () => riding?.stop());
document.addEventListener("visibilitychange", () => (live || riding) && !document.hidden && stayAwake());
requestAnimationFrame(draw);
keepOffline();
