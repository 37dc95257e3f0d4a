// Computes a board's time from its packets. A packet contains only the lowest 16 bits of the time in ms, and arrives
// late.

const PERIOD = 65536;
const DRIFT = 1e-4; // largest error of a board's clock, in seconds per second

export class BoardTime {
  #board = null; // time of the previous packet in ms, counted beyond 16 bits
  #arrived = 0;
  #least = Infinity; // arrival time minus board time of the fastest packet, in ms

  /** Take the time of a packet. ms: the 16 bits in the packet. arrivedMs: when it arrived. Returns {s, lateMs}. s: time
   * since the first packet, in seconds. lateMs: the packet's delay relative to the fastest packet. */
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

  /** Forget earlier delays after a new connection, because the board may have restarted its clock. */
  reconnected() {
    this.#least = Infinity;
  }

  #first = 0;
}
