// Wires the page: what the board sends is drawn, what the rider does is ordered.

import { Bike } from "./bike.mjs";
import { Board } from "./board.mjs";
import { Steering, connectButton, leanText } from "./controls.mjs";
import { Display } from "./display.mjs";
import { Guide } from "./guide.mjs";
import { keepOffline } from "./offline.mjs";
import { Road } from "./road.mjs";

const byId = (id) => document.getElementById(id);
const SLOW = 0.9; // of real time
const MOST_S = 0.1; // that the road moves on from one picture to the next
const settled = { kickstand: "kickstand", upright: "upright" };

const bike = new Bike(byId("bike"));
const road = new Road(byId("road"));
const guide = new Guide();
const state = { powered: true, plugged: true, armed: false, time: 0 };
let display;
let tick = { t_s: 0, lean_deg: -12, speed_mps: 0, yaw_rate_dps: 0, phase: "kickstand" };
let screen = { text: ["", ""], shown_deg: null };
let drawn = { t_s: -1 };
let told = null;

const board = new Board({
  ready() {
    byId("pose").disabled = false;
    for (const id of ["wire", "cut", "power"]) byId(id).disabled = false;
    keepOffline();
  },
  tick(next) {
    tick = next;
    state.time = next.t_s;
    if (next.powered !== state.powered) {
      state.powered = next.powered;
      state.armed = false;
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
    byId("slow").hidden = rate > SLOW;
    byId("press-help").hidden = rate <= SLOW;
  },
  failed(text) {
    byId("todo").textContent = `The simulated board has stopped: ${text}. Load the page again.`;
    byId("do").hidden = true;
  },
});

const steering = new Steering((name, value) => board.order(name, value));
connectButton((down) => board.button(down));

const actions = {
  kickstand: () => steering.stand("kickstand"),
  upright: () => steering.stand("upright"),
  ride: () => steering.stand("ride"),
  wire() {
    state.plugged = !state.plugged;
    board.order("sensor", state.plugged);
  },
  power: () => board.order("power", !state.powered),
  cut() {
    state.armed = true;
    board.order("cut_save", true);
  },
};

byId("do").addEventListener("click", () => actions[byId("do").dataset.action]());
for (const id of ["wire", "cut", "power"]) byId(id).addEventListener("click", actions[id]);
// After a click with the mouse the space bar is the board's button again
addEventListener("click", (event) => {
  if (event.detail && event.target.matches("button:not(#press)")) event.target.blur();
});

/** The guide's step and the faults, where they have changed. */
function tell() {
  const standing = tick.phase === settled[steering.pose];
  const step = guide.next(screen.text, screen.shown_deg, steering.pose, standing, state);
  toggle("wire", !state.plugged, state.plugged ? "Pull the sensor’s wire" : "Plug the sensor’s wire in");
  toggle("power", !state.powered, state.powered ? "Switch the power off" : "Switch the power on");
  toggle("cut", state.armed, state.armed ? "The next save will be cut" : "Cut the power in a save");
  if (!step || JSON.stringify(step) === told) return;
  told = JSON.stringify(step);
  byId("todo").textContent = step.text;
  byId("do").hidden = !step.action;
  byId("do").textContent = step.action?.[0] ?? "";
  byId("do").dataset.action = step.action?.[1] ?? "";
  if (step.number) {
    [...byId("steps").children].forEach((dot, i) => (dot.className = i + 1 < step.number ? "done" : i + 1 === step.number ? "now" : ""));
  }
}

function toggle(id, on, text) {
  put(id, text);
  byId(id).classList.toggle("on", on);
}

function draw() {
  const { t_s, lean_deg, speed_mps, yaw_rate_dps, phase } = tick;
  if (t_s !== drawn.t_s) {
    bike.draw(lean_deg, screen.shown_deg, steering.pose, speed_mps, phase === "brake");
    road.draw(speed_mps, yaw_rate_dps, Math.min(MOST_S, t_s - drawn.t_s));
    put("true-lean", leanText(lean_deg));
    put("shown-lean", screen.shown_deg === null ? "no lean" : leanText(screen.shown_deg, 0));
    put("speed-now", `${Math.round(speed_mps * 3.6)} km/h`);
    drawn = tick;
  }
  requestAnimationFrame(draw);
}

function put(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

const font = await fetch("./font.json").then((answer) => answer.json());
display = new Display(byId("display"), byId("display-said"), font);
if (screen.codes) display.show(screen);
draw();
