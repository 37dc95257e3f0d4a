// A simulated board for visitors without a real one. It runs the firmware, as on the page Try, during a repeated ride.

import { Board } from "../board.mjs";

const CRUISE_MPS = 17;
const TOWN_MPS = 9;
// [board time in s, action, value]: the two presses, then riding straight until the firmware is sure of its lean
const BEFORE = [
  [1.5, "button", true],
  [1.7, "button", false],
  [6, "pose", "upright"],
  [9.5, "button", true],
  [9.7, "button", false],
  [15, "pose", CRUISE_MPS],
  [27, "lean", 0],
];
// The repeated actions of the rider: [duration in s, action, value]
const RIDE = [
  [4, "lean", 28],
  [3.5, "lean", -36],
  [4, "lean", 0],
  [3, "pose", TOWN_MPS],
  [3.5, "lean", -18],
  [3, "lean", 22],
  [4, "pose", CRUISE_MPS],
  [4.5, "lean", 41],
  [4.5, "lean", -30],
  [3, "lean", 0],
];

export class SimulatedRide {
  #shown;
  #tell;
  #board = null;
  #beganS = null;
  #nextS = 0;
  #leg = 0;
  #furthest = { max_left_deg: 0, max_right_deg: 0 };

  /** shown: object whose functions moment([s, lean, forward g, null]) and furthest({max_left_deg, max_right_deg}) are
   * called. tell(text) is called with messages. */
  constructor(shown, tell) {
    this.#shown = shown;
    this.#tell = tell;
  }

  start() {
    this.#tell("The simulated board starts …");
    this.#board = new Board({
      ready: () => {
        this.#tell("The simulated board is aligned: stand, upright, then straight on …");
        this.#board.ahead(BEFORE);
      },
      tick: (tick) => this.#ride(tick),
      pressed() {},
      rate() {},
      failed: (text) => this.#tell(`The simulated board has stopped: ${text}. Load the page again.`),
    });
  }

  stop() {
    this.#board.end();
    this.#tell("Stopped.");
  }

  #ride({ t_s: nowS, meter }) {
    if (!meter || nowS < BEFORE.at(-1)[0]) return;
    this.#beganS ??= this.#nextS = nowS;
    if (nowS >= this.#nextS) {
      const [seconds, name, value] = RIDE[this.#leg++ % RIDE.length];
      this.#board.order(name, value);
      this.#nextS = nowS + seconds;
    }
    const [lean, forward] = meter;
    const most = this.#furthest;
    most.max_left_deg = Math.max(most.max_left_deg, -(lean ?? 0));
    most.max_right_deg = Math.max(most.max_right_deg, lean ?? 0);
    this.#shown.moment([nowS - this.#beganS, lean, forward, null]);
    this.#shown.furthest(most);
    const s = Math.floor(nowS - this.#beganS);
    this.#tell(`A simulated ride, which nobody has ridden: ${Math.floor(s / 60)}:${String(s % 60).padStart(2, "0")}`);
  }
}
