// Computes the time of a board from packets that contain 16 bits of it, in ms, and arrive late.

const PERIOD = 65536;
const DRIFT = 1e-4; // of a board's clock: apparent delay of a packet per second

export class BoardTime {
  #board = null; // ms of the previous packet, without overflow
  #arrived = 0;
  #least = Infinity; // arrival minus board time of the fastest packet

  /** ms: of a packet that arrived at arrivedMs. Returns {s, lateMs}: its time since the first packet, in seconds, and
   * its delay relative to the fastest packet. */
  take(ms, arrivedMs) {
    const passed = arrivedMs - this.#arrived;
    if (this.#board === null) this.#board = this.#first = ms;
    else {
      const expected = this.#board + passed;
      this.#board = ms + PERIOD * Math.round((expected - ms) / PERIOD);
    }
    this.#arrived = arrivedMs;
    const offset = arrivedMs - this.#board;
    this.#least = Math.min(this.#least + passed * DRIFT, offset);
    return { s: (this.#board - this.#first) / 1000, lateMs: offset - this.#least };
  }

  /** Reset after a new connection, perhaps to a board that was switched off and on: earlier delays mean nothing. */
  reconnected() {
    this.#least = Infinity;
  }

  #first = 0;
}
