// Finds the last stop. A stop is braking to a standstill.

const BRAKING_G = -0.1;
const PAUSE_S = 1; // after a longer pause the braking has ended
const STOOD_S = 6; // longest time from the end of the braking until the board detects the standstill

export class Stops {
  last = null; // {peak: g, seconds}
  #begun = null;
  #end = 0;
  #peak = 0;

  /** Take a reading. forward: forward acceleration in g, or null if unknown. atRest: true at a detected standstill. */
  take(s, forward, atRest) {
    if (this.#begun !== null && s - this.#end > STOOD_S) this.#begun = null;
    if (atRest) {
      if (this.#begun !== null) this.last = { peak: this.#peak, seconds: this.#end - this.#begun };
      this.#begun = null;
    } else if (forward !== null && forward < BRAKING_G) {
      if (this.#begun === null || s - this.#end > PAUSE_S) {
        this.#begun = s;
        this.#peak = 0;
      }
      this.#end = s;
      this.#peak = Math.max(this.#peak, -forward);
    }
  }
}
