// Tells the visitor what to do next: in the first minute, and after a fault. The advice depends on what the firmware
// shows.

import { shows } from "./shows.mjs";

const RIDE_S = 3; // the last step is done after the lean was held for this time
const WELL_DEG = 15; // smallest lean for the last step
// When the display has shown a lean on a straight road for this time, a bend no longer makes the firmware doubt the
// lean
const SURE_S = 7;
const STRAIGHT_DEG = 3; // a smaller lean is treated as riding straight

// The pose that the firmware wants, by the kind of view. A view that is not listed here does not change the wanted
// pose.
const WANTED = {
  unaligned: "kickstand",
  "ask-stand": "kickstand",
  "take-stand": "kickstand",
  "ask-upright": "upright",
  "take-upright": "upright",
  six: "six",
};
const PAGES = {
  maxima: "the largest lean to each side",
  force: "acceleration and braking, and their peaks",
  formula: "a published formula’s lean beside ours",
  readings: "what the sensor itself measures",
  recording: "the time that the ride has been recorded",
  info: "the sensor, and what is calibrated",
};

const ON_STAND = ["Put it on its stand", "kickstand"];
const UPRIGHT = ["Hold it upright", "upright"];
const RIDE = ["Ride", "ride"];
const STRAIGHT = ["Ride straight", "straight"];

/** Return a step. number: 1 to 4, 5 when all are done, 0 for advice that is not a step. text: the advice. action:
 * [label, action] of its button, or undefined for no button. */
const step = (number, text, action) => ({ number, text, action });

export class Guide {
  #wanted = "kickstand";
  #heldSince = null;
  #ridden = false;
  #shownSince = null;
  #sure = false; // true if the firmware has become sure of its lean since power-on
  #cut = false; // true from a power cut during a save until the next ride or alignment

  /** Record that the power was cut. inSave: true if this was during a save. */
  dark(inSave) {
    this.#cut = inSave;
    this.#sure = false;
  }

  /**
   * Return the next step, or null to keep the previous step.
   *
   * view: the firmware's view, as for shows().
   * shown: the lean on the display, or null if it shows none.
   * pose: "kickstand", "upright" or "ride".
   * standing: true if the motorcycle has come to rest in this pose.
   * state: {powered, plugged, armed: the next save will be cut, time: in s, lean_deg: the true lean}.
   */
  next(view, shown, pose, standing, state) {
    const { kind } = shows(view) ?? {};
    this.#wanted = WANTED[kind] ?? this.#wanted;
    if (kind === "aligned" || pose === "ride") this.#cut = false;
    return (
      this.#fault(kind, state) ??
      this.#alignment(kind, view, pose, standing) ??
      this.#use(kind, view, shown, pose, state)
    );
  }

  #fault(kind, state) {
    if (!state.powered) {
      const how = this.#cut
        ? "The power was cut after 40 bytes of the new calibration. Is the old one still there?"
        : "The board has no power: the display is dark.";
      return step(0, how, ["Switch it on", "power"]);
    }
    if (kind === "safe") {
      const how = "Safe mode, because the button was held at power-on. Switch the power off and on.";
      return step(0, how, ["Switch it off", "power"]);
    }
    if (kind === "dark" || kind === "starting") return step(0, "The board starts.");
    if (!state.plugged) {
      const how =
        kind === "menu"
          ? "The sensor’s wire is out. The menu hides the message, and closes after 20 seconds."
          : kind === "stopped"
            ? "The sensor’s wire is out: the meter stops the alignment."
            : "The sensor’s wire is out. The meter says so, and shows no lean.";
      return step(0, how, ["Plug it in", "wire"]);
    }
    if (kind === "stopped") return step(0, "The wire was out: the meter has stopped the alignment.");
    if (kind === "fault") return step(0, "The sensor answers again. The firmware sets it up.");
    return null;
  }

  #alignment(kind, view, pose, standing) {
    const stand = this.#wanted === "kickstand";
    const number = stand ? 1 : 2;
    const there = stand ? ON_STAND : UPRIGHT;
    const right = pose === this.#wanted;
    if (kind === "six" || (kind === "spoilt" && this.#wanted === "six")) {
      return step(0, "You cannot turn the sensor by hand on this page. Hold the button to leave.");
    }
    switch (kind) {
      case "unaligned":
      case "ask-stand":
        if (!right) return step(1, "Put the motorcycle on its stand first.", ON_STAND);
        if (!standing) return step(1, "The motorcycle comes to rest on its stand.");
        if (this.#cut) return step(1, "The meter ignores the half-written calibration. Press the button to begin again.");
        return step(1, "The motorcycle leans on its stand. The sensor is on it at any angle. Press the button.");
      case "ask-upright":
        if (!right) return step(2, "The meter knows the stand. Now hold the motorcycle upright.", UPRIGHT);
        return step(2, standing ? "Press the button once more." : "The motorcycle is being raised.");
      case "take-stand":
      case "take-upright":
        if (!right) {
          const said = stand
            ? "You have told the meter that the motorcycle is on its stand. Put it there."
            : "You have told the meter that the motorcycle is upright. Hold it upright.";
          return step(number, said, there);
        }
        if (!standing) return step(number, "The meter waits until the motorcycle is still.");
        if (!stand) return step(number, "Keep it still, until the bar is full.");
        return step(number, "Hands off for three seconds, until the bar is full.");
      case "spoilt":
        if (!right) return step(number, "The display says why this pose was refused.", there);
        if (!standing) return step(number, "The display says why this pose was refused. Wait until the bike is still.");
        return step(number, "The display says why this pose was refused. Press the button to try again.");
      case "unlike":
        if (view.code === "same-pose") {
          return step(1, "Both poses were the same. Press the button, and begin again with the stand.");
        }
        return step(1, "The display says why both poses were refused. Press the button to begin again.");
      case "aligned":
        return step(3, "Done: the meter knows the angle of the sensor. Ride!", pose === "ride" ? null : RIDE);
      default:
        return null;
    }
  }

  #use(kind, view, shown, pose, state) {
    if (kind !== "lean" && kind !== "menu" && !PAGES[kind]) return null;
    if (state.armed) return this.#save(kind, view, pose);
    if (kind === "menu") {
      return step(0, "Press for the next entry, or hold to choose it. The menu closes after 20 seconds.");
    }
    if (kind === "info") return step(0, `This page shows ${PAGES.info}. A press leaves it.`);
    const riding = pose === "ride";
    const number = this.#ridden ? 5 : riding ? 4 : 3;
    if (kind !== "lean") return step(number, `This page shows ${PAGES[kind]}. Press for the next.`, riding ? null : RIDE);
    if (riding) return this.#ride(shown, state);
    if (!this.#cut) return step(number, "The meter is aligned. Ride!", RIDE);
    return step(number, "The old alignment is still there. The meter ignores the half-written one. Ride!", RIDE);
  }

  /** Tell the visitor how to start a save of a calibration, during which the power will be cut. */
  #save(kind, view, pose) {
    if (pose !== "kickstand") {
      return step(0, "The power will be cut during the next save. Stop for a new alignment.", ON_STAND);
    }
    if (kind !== "menu") return step(0, "Hold the button for a second. The menu opens.");
    if (view.entry === "Align the bike") return step(0, "Hold the button once more to choose “Align the bike”.");
    return step(0, "Press until the menu says “Align the bike”, then hold the button for a second.");
  }

  #ride(shown, state) {
    if (!this.#sure && !this.#ridden) return this.#straight(shown, state);
    if (shown === null) {
      // In a steady bend no reading distinguishes a lean from a sensor error, so waiting does not help
      if (Math.abs(state.lean_deg) > STRAIGHT_DEG) {
        return step(4, "In a steady bend the meter cannot be sure: ride straight, or lean the other way.", STRAIGHT);
      }
      return step(4, "The meter is not sure yet, so it shows no lean. Ride straight for some seconds.");
    }
    if (Math.abs(shown) < WELL_DEG) this.#heldSince = null;
    else this.#heldSince ??= state.time;
    if (this.#heldSince !== null && state.time - this.#heldSince > RIDE_S) this.#ridden = true;
    if (this.#ridden) return step(5, "That is all. A press turns the pages. Now break something, or build one: see Install.");
    return step(4, "Lean it: drag the motorcycle or the slider. Compare both figures.");
  }

  /** Return the step that is shown until the firmware is sure of the lean. */
  #straight(shown, state) {
    if (shown === null) this.#shownSince = null;
    else this.#shownSince ??= state.time;
    this.#sure = this.#shownSince !== null && state.time - this.#shownSince > SURE_S;
    if (Math.abs(state.lean_deg) > STRAIGHT_DEG) {
      return step(4, "Not yet: the meter first needs ten seconds on a straight, to find its sensor’s errors.", STRAIGHT);
    }
    if (shown === null) {
      return step(4, "It rides straight. The meter is not sure yet, and says so instead of a wrong lean.");
    }
    return step(4, "It rides straight for ten seconds. In this time the meter finds its sensor’s errors.");
  }
}
