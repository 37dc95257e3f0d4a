// The time of a board whose packets carry 16 bits of it, in ms, and arrive late.

const PERIOD = 65536;
const DRIFT = 1e-4; // of a board's clock: what a packet may seem to be older by, in each second that passes

export class BoardTime {
  #board = null; // ms of the packet before, counted on
  #arrived = 0;
  #least = Infinity; // of arrival minus board: the quickest packet

  /** ms: of a packet that came at arrivedMs. Returns {s, lateMs}: its time since the first, in seconds, and by how much
   * later it came than the quickest. */
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

  /** A new connection, perhaps to a board that was switched off and on: how quick the packets were says nothing. */
  reconnected() {
    this.#least = Infinity;
  }

  #first = 0;
}
