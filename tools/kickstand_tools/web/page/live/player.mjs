// Plays readings that arrive in blocks of half a second. They are shown at the pace of the recording, half a second
// late.

const KEPT_S = 62;
const STALE_MS = 1200; // if no block arrives for this time (two are missing), the shown value is no longer valid
const JUMP_S = 0.7;
const EASE = 0.1; // share of a block's earliness or delay that is corrected

export class Player {
  /** The moments of the last minute, as in LiveReading (rides/stream.py). */
  moments = [];
  #late = null; // the browser's time minus the recording's time, in s
  #heardMs = -Infinity;

  /** Forget earlier moments before another recording is played. */
  restart() {
    this.moments = [];
    this.#late = null;
  }

  /** Add the moments of a block that has just arrived. */
  take(moments, nowMs) {
    if (!moments.length) return;
    const late = nowMs / 1000 - moments[0][0];
    this.#late = this.#late === null || Math.abs(late - this.#late) > JUMP_S ? late : this.#late + EASE * (late - this.#late);
    this.#heardMs = nowMs;
    this.moments.push(...moments);
    const since = this.moments.at(-1)[0] - KEPT_S;
    this.moments.splice(0, this.moments.findIndex(([s]) => s >= since));
  }

  /** Return {moment, until}. moment: the moment to show now, or null if nothing has arrived for STALE_MS. until: the
   * current time of the recording, in s. */
  now(nowMs) {
    const last = this.moments.at(-1);
    if (!last) return { moment: null, until: 0 };
    const until = Math.min(last[0], nowMs / 1000 - this.#late);
    const moment = this.moments.findLast(([s]) => s <= until) ?? null;
    return { moment: nowMs - this.#heardMs > STALE_MS ? null : moment, until };
  }
}
