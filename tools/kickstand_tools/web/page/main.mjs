// Connects the parts of the page: draws what the board sends, and sends the rider's actions as orders.

import { Bike } from "./bike.mjs";
import { Board } from "./board.mjs";
import { Steering, connectButton, leanText, speedText } from "./controls.mjs";
import { Display } from "./display.mjs";
import { fetched } from "./fetched.mjs";
import { Guide } from "./guide.mjs";
import { keepOffline } from "./offline.mjs";
import { Road } from "./road.mjs";
import { shows } from "./shows.mjs";

const byId = (id) => document.getElementById(id);
const SLOW = 0.9; // a pace below this share of real time is reported
const MOST_S = 0.1; // longest time by which the road advances between two pictures
const settled = { kickstand: "kickstand", upright: "upright" };
const FAULTS = {
  // the texts below the name of each button: while it is not pressed, and while it is pressed
  wire: ["plugged in", "out"],
  cut: ["not armed", "armed"],
  power: ["on", "off"],
};

const bike = new Bike(byId("bike"));
const road = new Road(byId("road"));
const guide = new Guide();
const state = { powered: true, plugged: true, armed: false, stopped: false, time: 0, lean_deg: 0 };
let display;
let tick = { t_s: 0, lean_deg: -12, speed_mps: 0, yaw_rate_dps: 0, phase: "kickstand" };
let screen = { text: ["", ""], shown_deg: null };
let view = { view: "starting" }; // the view of the firmware
let words = "–"; // replaces a lean that the display does not show
let drawn = { t_s: -1 };
let shownStep = null;

const board = new Board({
  ready() {
    byId("pose").disabled = false;
    for (const id in FAULTS) byId(id).disabled = false;
    byId("kind").disabled = false;
    keepOffline().then((kept) => byId("offline").classList.toggle("away", !kept));
  },
  tick(next) {
    tick = next;
    state.time = next.t_s;
    state.lean_deg = next.lean_deg;
    if (next.powered !== state.powered) {
      state.powered = next.powered;
      if (!state.powered) guide.dark(state.armed);
      state.armed = false;
    }
    if (next.state) {
      view = next.state;
      words = shows(view)?.words ?? words;
    }
    if (next.display) {
      screen = next.display;
      display?.show(screen);
    }
    tell();
  },
  pressed(down) {
    byId("press").classList.toggle("down", down);
  },
  rate(rate) {
    byId("slow").classList.toggle("away", rate > SLOW);
    byId("press-help").classList.toggle("away", rate <= SLOW);
  },
  failed(text) {
    stop(`The simulated board has stopped: ${text}. Load the page again.`);
  },
});

const steering = new Steering((name, value) => board.order(name, value));
connectButton((down) => board.button(down));

const actions = {
  kickstand: () => steering.stand("kickstand"),
  upright: () => steering.stand("upright"),
  ride: () => steering.stand("ride"),
  straight: () => steering.lean(0),
  wire() {
    state.plugged = !state.plugged;
    board.order("sensor", state.plugged);
  },
  power() {
    state.armed = false; // the visitor switches the power off, so no save will be cut
    board.order("power", !state.powered);
  },
  cut() {
    state.armed = !state.armed;
    board.order("cut_save", state.armed);
  },
};

byId("do").addEventListener("click", () => {
  actions[byId("do").dataset.action]();
  focusPress();
});
for (const id in FAULTS) {
  byId(id).addEventListener("click", (event) => {
    // Show the guide, which explains and undoes the fault. On a phone the guide may be out of sight.
    if (event.currentTarget.ariaPressed === "false") byId("todo").parentElement.scrollIntoView({ block: "nearest" });
    actions[id]();
  });
}
byId("kind").value = "lcd"; // a browser keeps the earlier choice when the page is loaded again
byId("kind").addEventListener("change", (event) => {
  board.order("display", event.target.value);
  focusPress();
});
// After a mouse click the space bar presses the board's button again
addEventListener("click", (event) => {
  if (event.detail && event.target.closest("button:not(#press, #do)")) document.activeElement.blur();
});

/** Move the focus to the control of the next step, or to a place where the arrow keys lean the bike. This is needed
 * because the guide's button disappears together with its step. */
function focusPress() {
  byId("press").focus({ preventScroll: true });
}

/** Show the guide's step and the faults if they have changed. */
function tell() {
  const standing = tick.phase === settled[steering.pose];
  const step = guide.next(view, screen.shown_deg, steering.pose, standing, state);
  toggle("wire", !state.plugged);
  toggle("cut", state.armed);
  toggle("power", !state.powered);
  if (!step || state.stopped || JSON.stringify(step) === shownStep) return;
  shownStep = JSON.stringify(step);
  byId("todo").textContent = step.text;
  put("guide-title", step.number ? "Your first minute" : "What happens now");
  if (!step.action && document.activeElement === byId("do")) focusPress();
  byId("do").hidden = !step.action;
  byId("do").textContent = step.action?.[0] ?? "";
  byId("do").dataset.action = step.action?.[1] ?? "";
  if (step.number) {
    [...byId("steps").children].forEach((dot, i) => (dot.className = i + 1 < step.number ? "done" : i + 1 === step.number ? "now" : ""));
  }
}

function toggle(id, on) {
  byId(id).setAttribute("aria-pressed", String(on));
  put(`${id}-now`, FAULTS[id][Number(on)]);
}

/** Show that the firmware cannot be loaded or has stopped. */
function stop(text) {
  state.stopped = true;
  byId("todo").textContent = text;
  byId("do").hidden = true;
}

function draw() {
  const { t_s, lean_deg, speed_mps, yaw_rate_dps, phase } = tick;
  if (t_s !== drawn.t_s) {
    bike.draw(lean_deg, screen.shown_deg, steering.pose, speed_mps, phase === "brake");
    road.draw(speed_mps, yaw_rate_dps, Math.min(MOST_S, t_s - drawn.t_s));
    put("true-lean", leanText(lean_deg));
    put("shown-lean", screen.shown_deg === null ? words : leanText(screen.shown_deg, 0));
    put("speed-now", speedText(speed_mps));
    steering.follow(lean_deg, speed_mps);
    drawn = tick;
  }
  requestAnimationFrame(draw);
}

function put(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

try {
  display = new Display(byId("display"), byId("display-said"), await (await fetched("./font.json")).json());
  if (screen.codes || screen.pixels) display.show(screen);
  draw();
} catch (error) {
  stop(`The display cannot be drawn: ${error.message}. Load the page again.`);
}
