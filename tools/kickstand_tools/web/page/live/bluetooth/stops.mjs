// The last stop: a braking after which the vehicle stood.

const BRAKING_G = -0.1;
const PAUSE_S = 1; // without braking for longer, it was over
const STOOD_S = 6; // between the end of the braking and the board's being sure that it stands

export class Stops {
  last = null; // {peak: g, seconds}
  #begun = null;
  #end = 0;
  #peak = 0;

  /** forward: g, or null for not known; atRest: the vehicle stands, by the board. */
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
