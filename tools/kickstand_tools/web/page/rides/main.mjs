// Wires the page: files come in, what the tools say of them is shown.

import { fetched } from "../fetched.mjs";
import { keepOffline, keptOffline } from "../offline.mjs";
import { takePulled } from "./pulled.mjs";
import { hideRide, save, showCharts, showReport } from "./show.mjs";
import { Tools } from "./tools.mjs";

const byId = (id) => document.getElementById(id);
const tools = new Tools((done, of) => of && (byId("work-bar").value = done / of));
let given = []; // File objects
let rides = []; // {log, calibration}, as rides() of web/rides_guest.py says
let looked = null;
let turn = 0; // of the work that is wanted: what was begun for an earlier one is not shown

/** Look at a ride. files: File objects; a calibration alone goes with the files of before. */
export async function openRide(files) {
  const adds = files.length > 0 && files.every(isCalibration);
  const names = files.map((file) => file.name);
  given = [...(adds ? given.filter((file) => !names.includes(file.name)) : []), ...files];
  await work("Loading Python, 8 MB the first time …", async () => {
    await keptOffline();
    tools.give(given);
    rides = await tools.call("rides");
    byId("ride").replaceChildren(...rides.map(({ log }) => new Option(log, log)));
    byId("which").hidden = rides.length < 2;
    return rides[0];
  }, look);
}

const isCalibration = (file) => file.name.toLowerCase().endsWith(".json");

async function look(ride) {
  if (!ride.taken) {
    await work(`Reading ${ride.log} …`, () => tools.call("take", ride.log), async (found) => {
      Object.assign(ride, { taken: found, given: ride.log, log: found.log });
      await look(ride);
    });
    return;
  }
  if (!ride.calibration) {
    say(`${ride.given} has no calibration with it. Add its .cal.json, or let the ride tell how the sensor sits: that takes some minutes of riding with bends to both sides.`, true);
    byId("align").hidden = false;
    return;
  }
  await work(`Looking at ${ride.given} …`, () => tools.call("look", ride.log, ride.calibration), (found) => {
    const warnings = [...new Set([...(ride.taken.warnings ?? []), ...found.warnings])];
    looked = { ...found, ride };
    showReport({ ...found, warnings });
    showCharts(found.page);
    byId("save-calibration").hidden = !ride.aligned;
    byId("save-log").hidden = !ride.taken.made;
    say(ride.aligned ?? "");
  });
}

async function align() {
  const ride = chosen();
  await work(`Looking how the sensor sits in ${ride.given} …`, () => tools.call("align", ride.log), async (found) => {
    const [roll, pitch, yaw] = [found.roll_deg, found.pitch_deg, found.yaw_deg];
    const aligned = `The ride tells how the sensor sits: roll to ${roll}°, pitch to ${pitch}°, yaw to ${yaw}°.`;
    Object.assign(ride, { calibration: found.path, aligned, bytes: found.made });
    await look(ride);
  });
}

async function saveLean() {
  const { ride, stem } = looked;
  await work(`Finding the lean of each sample of ${ride.given} …`, async () => {
    const { made } = await tools.call("smooth", ride.log, ride.calibration);
    save(`${stem}.lean.csv`, "text/csv", made); // also where another ride was chosen meanwhile
  }, () => say(""), true);
}

async function savePage() {
  const { page, plotly, stem } = looked;
  await work("Loading what draws the charts …", () => fetched(plotly).then((answer) => answer.text()), (library) => {
    save(`${stem}.html`, "text/html", page.replace(`<script src="${plotly}"></script>`, () => `<script>${library}</script>`));
    say("");
  }, true);
}

const chosen = () => rides[Math.max(0, byId("ride").selectedIndex)];

/** Do it, saying so, then show what came of it; or say why nothing did. stays: what is shown stays meanwhile. */
async function work(text, begin, show, stays = false) {
  const mine = ++turn;
  say(text);
  byId("align").hidden = true;
  byId("work").hidden = false;
  byId("work-bar").removeAttribute("value");
  if (!stays) hideRide();
  let found, wrong;
  try {
    found = await begin();
  } catch (error) {
    wrong = error.message;
  }
  if (mine !== turn) return;
  byId("work").hidden = true;
  if (!tools.open) forget();
  if (wrong) say(`${wrong}.`, true);
  else await show(found);
}

function say(text, wrong = false) {
  byId("said").textContent = text;
  byId("said").classList.toggle("wrong", wrong);
}

function stop() {
  turn++;
  tools.stop();
  forget();
  byId("work").hidden = true;
  say("Stopped.");
}

/** The files that were given went with the worker, and what is shown could not be saved any more. */
function forget() {
  given = rides = [];
  byId("which").hidden = true;
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
byId("stop").addEventListener("click", stop);
byId("save-lean").addEventListener("click", saveLean);
byId("save-page").addEventListener("click", savePage);
byId("save-json").addEventListener("click", () => save(`${looked.stem}.json`, "application/json", JSON.stringify(looked.json, null, 1)));
byId("save-log").addEventListener("click", () => save(looked.ride.log, "text/csv", looked.ride.taken.made));
byId("save-calibration").addEventListener("click", () => save(`${looked.stem}.cal.json`, "application/json", looked.ride.bytes));

keepOffline();
if (location.hash === "#pulled") {
  history.replaceState(null, "", "./rides.html");
  const files = await takePulled();
  if (files.length) await openRide(files);
}
