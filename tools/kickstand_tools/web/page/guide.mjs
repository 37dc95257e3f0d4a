// What to do next, told from what the display says: the first minute, and what to look at after a fault.

const RIDE_S = 3; // that the lean is held before the last step counts as done
const WELL_DEG = 15;

const REFUSED = /^(Moved!|Same pose|Tilt |Gyro offset|Not saved)/; // lines of firmware/kickstand/ui/messages.py
const MENU = "→"; // begins a line of the menu

/** A step: number (1 to 4, 0 for none), text, and the action that its button does: [label, what], or none. */
const step = (number, text, action) => ({ number, text, action });

export class Guide {
  #heldSince = null;
  #ridden = false;
  #wasArmed = false;

  /**
   * The step that fits. lines: the display's two; shown: the lean that it shows, or null. pose: "kickstand", "upright",
   * "ride"; standing: it has come to rest in it. state: {powered, plugged, armed (a save will be cut), time (s)}.
   */
  next(lines, shown, pose, standing, state) {
    const [first, second] = lines;
    if (state.armed) this.#wasArmed = true;
    if (!state.powered) {
      const text = this.#wasArmed
        ? "The power went when 40 bytes of the calibration were written. Is the old one still there?"
        : "The board has no power: the display is dark.";
      return step(0, text, ["Switch it on", "power"]);
    }
    if (!state.plugged) {
      return step(0, "The sensor’s wire is out. The meter says so, and shows no lean that it does not know.", ["Plug it in", "wire"]);
    }
    if (first.startsWith("Sensor")) return step(0, "The sensor is there again: the firmware sets it up anew.");
    if (first.startsWith("Raw ") || first.startsWith("On the stand")) {
      if (pose !== "kickstand") return step(1, "Put the motorcycle on its stand first.", ["Put it on its stand", "kickstand"]);
      if (!standing) return step(1, "The motorcycle goes onto its stand.");
      const text = "The motorcycle leans on its stand, the sensor sits on it at any angle. Press the button.";
      return step(1, this.#wasArmed && !state.armed ? "Nothing that was half written is believed: begin again. Press the button." : text);
    }
    if (first.startsWith("Stand: hold")) return step(1, "Hands off for three seconds, until the bar is full.");
    if (first.startsWith("Now upright")) {
      if (pose !== "upright") return step(2, "The meter knows the stand. Now hold the motorcycle upright.", ["Hold it upright", "upright"]);
      return step(2, standing ? "Press the button once more." : "The motorcycle comes upright.");
    }
    if (first.startsWith("Upright: hold")) return step(2, "Keep it still, until the bar is full.");
    if (first.startsWith("Aligned")) return step(3, "Done: the meter knows how the sensor sits. Ride!", pose === "ride" ? null : ["Ride", "ride"]);
    if (REFUSED.test(first)) return step(0, "The meter says why it does not take this. Stand still, and press the button again.");
    if (state.armed) return this.#save(first, second, pose);
    if (first.startsWith("Lean")) return this.#ride(shown, pose, state);
    return null;
  }

  /** How to have the firmware save a calibration, which is to be cut. */
  #save(first, second, pose) {
    if (pose !== "kickstand") return step(0, "The power goes in the middle of the next save. Stop for a new alignment.", ["Put it on its stand", "kickstand"]);
    if (first.startsWith(`${MENU}Align the bike`)) return step(0, "Hold the button once more: “Align the bike” is chosen.");
    return step(0, "Hold the button for a second: the menu comes.");
  }

  #ride(shown, pose, state) {
    if (this.#wasArmed) {
      this.#wasArmed = false;
      this.#ridden = false;
    }
    if (pose !== "ride") return step(3, "The meter is aligned. Ride!", ["Ride", "ride"]);
    if (shown === null) return step(4, "The meter is not sure yet. It says so, rather than show a wrong lean: ride on.");
    if (Math.abs(shown) < WELL_DEG) this.#heldSince = null;
    else this.#heldSince ??= state.time;
    if (this.#heldSince !== null && state.time - this.#heldSince > RIDE_S) this.#ridden = true;
    if (this.#ridden) return step(5, "That is all there is to it. A press turns the pages, a long one opens the menu. Or break something.");
    return step(4, "Lean it: arrow keys, the slider, or drag the motorcycle. Compare both figures.");
  }
}
