// Runs the page while a board on the motorcycle sends over Bluetooth. The lean fills the screen. Readings are kept.

import { busy, offer } from "../files.mjs";
import { LEAN, SIDEWAYS } from "../measures.mjs";
import { BoardTime } from "./board_time.mjs";
import { Link, chooseBoard } from "./link.mjs";
import { BluetoothLog } from "./log.mjs";
import { ALIGNED, AT_REST, CAR, FALLEN, NO_READINGS, decodeNow, decodeRide } from "./packets.mjs";
import { Stops } from "./stops.mjs";

const LATE_MS = 500; // an older packet, queued during a poor connection, is kept but not shown
const byId = (id) => document.getElementById(id);

/** A ride over Bluetooth until the rider stops it. shown: the object of this name in live.mjs. */
export class Riding {
  #shown;
  #link = null;
  #time = new BoardTime();
  #stops = new Stops();
  #log = new BluetoothLog();
  #said = "";

  constructor(shown) {
    this.#shown = shown;
  }

  async run() {
    const tell = (text) => (byId("riding-said").textContent = text);
    const device = await chooseBoard(tell);
    if (!device) return;
    const began = new Date();
    this.#look(true);
    this.#link = new Link(device, {
      now: (view) => this.#receive(decodeNow(view)),
      ride: (view) => this.#receiveRide(decodeRide(view)),
      state: (text) => this.#tell(text),
      back: () => this.#time.reconnected(),
    });
    const refused = await this.#link.run();
    this.#look(false);
    const files = this.#log.files(began);
    if (files.length) offer(byId("files"), `Over Bluetooth, from ${began.toLocaleTimeString()}`, files);
    tell(`${refused ?? "Stopped"}.${files.length ? " What came is below." : ""}`);
  }

  stop() {
    this.#link?.stop();
  }

  /** on: show only what the rider needs while riding. */
  #look(on) {
    document.body.classList.toggle("riding", on);
    byId("ride").hidden = on;
    byId("ride-stop").hidden = byId("last-stop-figure").hidden = !on;
    this.#shown.begin();
    busy(on);
    if (!on) byId("ride").scrollIntoView({ block: "center" });
  }

  #receive(now) {
    const { s, lateMs } = this.#time.take(now.ms, performance.now());
    this.#log.take(now, s);
    this.#shown.measure(now.state & CAR ? SIDEWAYS : LEAN);
    if (lateMs > LATE_MS) return;
    this.#stops.take(s, now.force[2], (now.state & AT_REST) !== 0);
    this.#shown.moment([s, now.lean, now.force[2], now.force[0]]);
    const { last } = this.#stops;
    byId("last-stop").textContent = last ? `${last.peak.toFixed(2)} g, ${last.seconds.toFixed(1)} s` : "--";
    this.#tell(said(now));
  }

  #receiveRide(ride) {
    this.#log.takeRide(ride);
    this.#shown.furthest(ride);
  }

  #tell(text) {
    if (text === this.#said) return;
    this.#said = byId("riding-now").textContent = text;
  }
}

/** Return the text beside the lean, or "" for no text. */
function said({ state, lean }) {
  if (state & NO_READINGS) return "The sensor gives no readings";
  if (!(state & ALIGNED)) return "The board is not aligned yet";
  if (state & FALLEN) return "Fallen over?";
  return lean === null && !(state & CAR) ? "Not sure yet" : "";
}
