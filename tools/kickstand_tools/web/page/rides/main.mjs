// Connects the parts of the page: passes files to the tools and shows their results.

import { fetched } from "../fetched.mjs";
import { keepOffline, keptOffline } from "../offline.mjs";
import { Held, size } from "./held.mjs";
import { takePulled } from "./pulled.mjs";
import { hideRide, save, showCharts, showReport } from "./show.mjs";
import { askColumns, askNothing } from "./table.mjs";
import { Tools } from "./tools.mjs";

const byId = (id) => document.getElementById(id);
const PLOTLY = "./plotly/plotly.min.js"; // as web/browser_rides.py names it
const SAMPLE = ["simulated-ride.csv.gz", "simulated-ride.cal.json"];
const tools = new Tools((done, of, loading) => {
  if (of) byId("work-bar").value = done / of;
  if (loading) showReady(done, of);
});
const held = new Held(byId("held"), () => sortOut([]));
let rides = []; // the rides from rides() of web/browser_rides.py, each with its results (see kept())
let looked = null;
let current = ""; // the ride that was chosen last
let loaded = false; // true when Python and everything that the tools need are loaded
let turn = 0; // number of the current request; results of earlier requests are not shown

/** Show a ride. files: File objects, which are added to the held files. */
export async function openRide(files) {
  held.add(files);
  await sortOut(files.map((file) => file.name));
}

/** Identify the held files, and show the ride of the new files. added: names of the new files. */
async function sortOut(added) {
  held.show();
  await work(loaded ? "Looking through the files …" : "Loading the tools, 8 MB the first time …", async () => {
    const mine = turn;
    await keptOffline();
    const unreadable = {};
    const files = await held.readable(unreadable);
    if (mine !== turn) return; // a later request has passed its files to the worker
    if (tools.give(files)) [rides, looked] = [[], null]; // the worker has lost its earlier results
    const found = await tools.call("rides", JSON.stringify(files.map(({ name }) => name)));
    return { ...found, why: { ...found.why, ...unreadable } };
  }, async (found) => {
    rides = found.rides.map(kept);
    held.show(found);
    byId("ride").replaceChildren(...rides.map((ride) => new Option(`${ride.given}, ${size(ride.bytes)}`, ride.given)));
    byId("which").hidden = rides.length < 2;
    const wrong = added.map((name) => found.why[name]).find(Boolean);
    const now = rides.find((one) => one.given === current);
    const concerned = [now, ...rides].find((one) => one && (added.includes(one.calibration) || added.includes(one.track)));
    const matching = rides.find((one) => one.files.some((name) => added.includes(name))) ?? concerned;
    const ride = matching ?? now ?? rides[0];
    byId("ride").selectedIndex = rides.indexOf(ride);
    const only = !rides.length && Object.values(found.kinds).includes("calibration");
    say(only ? "This is a calibration. Now add the ride that it belongs to." : "");
    if (!ride) hideRide();
    else if (isShown(ride)) sayOf(ride);
    else await look(ride);
    const named = added.filter((name) => found.why[name]).join(", ");
    if (wrong && !byId("work").hidden) return;
    if (wrong && !ride) say(`${named} cannot be used: the list says why.`, true);
    byId("given-wrong").textContent = wrong && ride ? `${named} cannot be used: the list says why.` : "";
  }, true);
}

/** Return the ride, with the results of an earlier ride from the same files if there is one. */
function kept(ride) {
  const sources = [...ride.files, ...(ride.track ? [ride.track] : [])].map((name) => held.file(name));
  const bytes = sources.reduce((sum, file) => sum + file.size, 0);
  const same = (old) => old.given === ride.log && old.sources.length === sources.length && old.sources.every((file, k) => file === sources[k]);
  const { log = ride.log, taken, fitted } = rides.find(same) ?? {};
  return { ...ride, given: ride.log, sources, bytes, log, taken, fitted };
}

const calibrationOf = (ride) => ride.calibration || ride.fitted?.path;

/** True if the page already shows this ride. */
function isShown(ride) {
  const { given, sources } = looked?.ride ?? {};
  const same = given === ride.given && sources.length === ride.sources.length && sources.every((file, k) => file === ride.sources[k]);
  if (!same || byId("report").hidden || looked.calibration !== calibrationOf(ride)) return false;
  looked.ride = ride;
  return looked.calibrationFile === held.file(ride.calibration);
}

async function look(ride) {
  current = ride.given;
  if (!ride.taken) {
    if (ride.table && !ride.asked) {
      hideRide();
      ask(ride);
      const asked = ride.table.certain ? "check what its columns are" : "say what its columns are";
      say(`${ride.given} is not of an app that is known${ride.table.lacking}: ${asked}.`);
      return;
    }
    const { columns = {}, units = {} } = ride.asked ?? {};
    const given = [ride.log, ride.isLog, JSON.stringify(columns), JSON.stringify(units), ride.track];
    const done = await work(`Reading ${ride.given} …`, () => tools.call("take", ...given), async (found) => {
      Object.assign(ride, { taken: found, log: found.log });
      await look(ride);
    });
    if (!done && ride.table) ask(ride);
    return;
  }
  if (!calibrationOf(ride)) {
    say(`${ride.given} has no calibration with it. Add its .cal.json, or find out from the ride itself how the sensor sits: that takes some minutes of riding with bends to both sides.`, true);
    hideRide();
    byId("align").hidden = false;
    return;
  }
  const calibration = calibrationOf(ride);
  await work(`Looking at ${ride.given} …`, async () => {
    const [found, drawing] = await Promise.all([tools.call("look", ride.log, calibration), library()]);
    return { ...found, charts: whole(found.page, found.plotly, drawing) };
  }, (found) => {
    const warnings = [...new Set([...(ride.taken.warnings ?? []), ...found.warnings])];
    looked = { ...found, ride, calibration, calibrationFile: held.file(ride.calibration) };
    showReport({ ...found, warnings, name: ride.given, calibration: ride.calibration || "by this ride" });
    showCharts(found.charts);
    byId("save-calibration").hidden = Boolean(ride.calibration);
    byId("save-log").hidden = !ride.taken.made;
    sayOf(ride);
  });
}

/** Return the remarks about the shown ride. */
function sayOf(ride) {
  const sample = ride.given === SAMPLE[0] ? "This ride is simulated: nobody has ridden it." : "";
  const aligned = ride.calibration ? "" : ride.fitted?.words;
  say([sample, ride.taken.words, aligned].filter(Boolean).join(" "));
}

function ask(ride) {
  askColumns(ride.given, ride.table, (columns, units) => {
    ride.asked = { columns, units };
    look(ride);
  });
}

async function align() {
  const ride = chosen();
  await work(`Finding how the sensor sits in ${ride.given} …`, () => tools.call("align", ride.log), async (found) => {
    const [roll, pitch, yaw] = [found.roll_deg, found.pitch_deg, found.yaw_deg];
    const words = `Aligned by this ride: roll is known within ${roll}°, pitch within ${pitch}°, yaw within ${yaw}°.`;
    ride.fitted = { path: found.path, words, bytes: found.made };
    await look(ride);
  });
}

async function saveLean() {
  const { ride, stem, calibration } = looked;
  await work(`Finding the lean of each sample of ${ride.given} …`, async () => {
    const { made } = await tools.call("smooth", ride.log, calibration);
    save(`${stem}.lean.csv`, "text/csv", made); // even if another ride was chosen meanwhile
  }, () => say(""), true);
}

/** Return the page of the charts with the library in it. Its frame lacks this page's rights, so it cannot load files
 * that are kept offline. */
function whole(page, plotly, library) {
  const [allowed] = document.querySelector("meta[http-equiv]").content.match(/'sha256-[^']+'/); // see web/site.py
  return page
    .replace("script-src 'self'", () => `script-src ${allowed}`)
    .replace(`<script src="${plotly}"></script>`, () => `<script>${library}</script>`);
}

async function savePage() {
  const { page, plotly, stem } = looked;
  await work("Loading the charts …", library, (drawing) => {
    save(`${stem}.html`, "text/html", whole(page, plotly, drawing));
    say("");
  }, true);
}

const library = () => fetched(PLOTLY).then((answer) => answer.text());

/** Show the progress of fetching the tools, while nobody waits for them. */
function showReady(done, of) {
  loaded = of === 1;
  if (loaded) byId("work-bar").removeAttribute("value");
  byId("ready").textContent = loaded ? "" : `Loading the tools: ${Math.floor((100 * done) / of)} %.`;
}

/** Fetch the tools while the visitor reads, unless the browser is set to save data. */
async function fetchAhead() {
  await keptOffline();
  if (navigator.connection?.saveData) return;
  tools.begin();
  await library().catch(() => {});
}

async function sample() {
  byId("sample").disabled = true;
  try {
    const files = SAMPLE.map(async (name) => new File([await (await fetched(`./sample/${name}`)).blob()], name));
    await openRide(await Promise.all(files));
  } catch (error) {
    say(ended(error.message), true);
  }
  byId("sample").disabled = false;
}

const chosen = () => rides[Math.max(0, byId("ride").selectedIndex)];

/** Announce text, call begin(), and show its result with show(). If it fails, show the reason and return false. stays:
 * true to keep the current content meanwhile. */
async function work(text, begin, show, stays = false) {
  const mine = ++turn;
  say(text);
  for (const id of ["align", "again"]) byId(id).hidden = true;
  askNothing();
  byId("work").hidden = false;
  byId("work-bar").removeAttribute("value");
  if (!stays) hideRide();
  let found, wrong;
  try {
    found = await begin();
  } catch (error) {
    wrong = error.message;
  }
  if (mine !== turn) return true;
  byId("work").hidden = true;
  if (!tools.open) {
    loaded = false;
    forget();
  }
  if (wrong) say(ended(wrong), true);
  else await show(found);
  return !wrong;
}

const ended = (line) => (/[.?!]$/.test(line) ? line : `${line}.`);

function say(text, wrong = false) {
  byId("said").textContent = text;
  byId("said").classList.toggle("wrong", wrong);
}

function stop() {
  loaded = false;
  turn++;
  tools.stop();
  forget();
  byId("work").hidden = true;
  say("Stopped.");
}

/** Clear the page. The worker has lost its results, so the shown ride could no longer be saved. */
function forget() {
  rides = [];
  looked = null;
  byId("which").hidden = true;
  byId("again").hidden = !held.files.length;
  hideRide();
}

byId("files").addEventListener("change", () => {
  const files = [...byId("files").files];
  byId("files").value = ""; // the same files may be chosen again
  if (files.length) openRide(files);
});
addEventListener("dragover", (event) => {
  event.preventDefault();
  byId("drop").classList.add("over");
});
addEventListener("dragleave", () => byId("drop").classList.remove("over"));
addEventListener("drop", (event) => {
  event.preventDefault();
  byId("drop").classList.remove("over");
  if (event.dataTransfer.files.length) openRide([...event.dataTransfer.files]);
});
byId("ride").addEventListener("change", () => look(chosen()));
byId("align").addEventListener("click", align);
byId("sample").addEventListener("click", sample);
byId("again").addEventListener("click", () => sortOut([]));
byId("stop").addEventListener("click", stop);
byId("save-lean").addEventListener("click", saveLean);
byId("save-page").addEventListener("click", savePage);
byId("save-json").addEventListener("click", () => save(`${looked.stem}.json`, "application/json", JSON.stringify(looked.json, null, 1)));
byId("save-log").addEventListener("click", () => save(`${looked.stem}.csv`, "text/csv", looked.ride.taken.made));
byId("save-calibration").addEventListener("click", () => save(`${looked.stem}.cal.json`, "application/json", looked.ride.fitted.bytes));

keepOffline();
fetchAhead();
if (location.hash === "#pulled") {
  history.replaceState(null, "", "./rides.html");
  try {
    const files = await takePulled();
    if (files.length) await openRide(files);
  } catch {
    say("This browser keeps nothing for the page, as in a private window: save the rides on the page Live, and give them here.", true);
  }
}
