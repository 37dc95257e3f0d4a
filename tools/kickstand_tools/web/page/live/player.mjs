// Readings come in blocks of half a second: they are played at the pace at which they were taken, half a second late.

const KEPT_S = 62;
const STALE_MS = 1200; // without a block, two of which should have come: what was shown is no longer so
const JUMP_S = 0.7;
const EASE = 0.1; // of what a block comes early or late

export class Player {
  /** All of the last minute, as LiveReading (rides/stream.py) has them. */
  moments = [];
  #late = null; // s of our time minus s of the recording
  #heardMs = -Infinity;

  /** Forget what came before: another recording begins. */
  restart() {
    this.moments = [];
    this.#late = null;
  }

  /** Take the moments of a block, which has just come. */
  take(moments, nowMs) {
    if (!moments.length) return;
    const late = nowMs / 1000 - moments[0][0];
    this.#late = this.#late === null || Math.abs(late - this.#late) > JUMP_S ? late : this.#late + EASE * (late - this.#late);
    this.#heardMs = nowMs;
    this.moments.push(...moments);
    const since = this.moments.at(-1)[0] - KEPT_S;
    this.moments.splice(0, this.moments.findIndex(([s]) => s >= since));
  }

  /** {moment, until}: what to show now, null where nothing has come for too long; and up to where time has come, s. */
  now(nowMs) {
    const last = this.moments.at(-1);
    if (!last) return { moment: null, until: 0 };
    const until = Math.min(last[0], nowMs / 1000 - this.#late);
    const moment = this.moments.findLast(([s]) => s <= until) ?? null;
    return { moment: nowMs - this.#heardMs > STALE_MS ? null : moment, until };
  }
}
