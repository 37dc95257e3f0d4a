"""What the sensor felt during the last seconds, so that it can be laid beside a speed that comes late.

Kept are running integrals in whole numbers that wrap round: differences of them are exact however long the drive, where
sums in float32 are not; and whole numbers take no heap.
"""

from array import array

BIN_US = 100_000
SIZE = 64  # bins: a late speed, the interval before it, and some time to work on them
MASK = 0x1FFFFFFF
_HALF = 0x10000000
COLUMNS = 4  # force (3, in millionths of g s), angle turned about the vertical (in 1e-5 degrees)


def difference(a, b):
    """a - b of two values that wrap round."""
    return ((a - b + _HALF) & MASK) - _HALF


class ForceHistory:
    """Integrals of force and yaw rate over time, at the end of every bin. now: time in us, wraps round."""

    def __init__(self):
        self._times = array("i", [0] * SIZE)
        self._columns = [array("i", [0] * SIZE) for _ in range(COLUMNS)]
        self._total = [0] * COLUMNS
        self._newest = 0
        self._count = 1  # of entries that can be looked up
        self.now = 0

    def clear(self):
        """Samples are missing: what came before does not join what follows."""
        self._count = 1

    def add(self, force_us, yaw, dt_us):
        """One more bin: integrals over it of force (3, g us) and of the yaw rate (1e-5 degrees); its length."""
        self.now = (self.now + dt_us) & MASK
        total = self._total
        total[0] = (total[0] + round(force_us[0])) & MASK
        total[1] = (total[1] + round(force_us[1])) & MASK
        total[2] = (total[2] + round(force_us[2])) & MASK
        total[3] = (total[3] + round(yaw)) & MASK
        self._newest = newest = (self._newest + 1) % SIZE
        self._times[newest] = self.now
        for k in range(COLUMNS):
            self._columns[k][newest] = total[k]
        self._count = min(SIZE, self._count + 1)

    def at(self, out, time_us):
        """Fill out (COLUMNS integers) with the integrals up to a time. False if it is not within the history."""
        behind = difference(self.now, time_us)
        if behind < 0 or behind >= difference(self.now, self._times[(self._newest - self._count + 1) % SIZE]):
            return False
        i = self._newest
        step = behind // (2 * BIN_US)  # bins may be longer than BIN_US, but hardly twice as long
        if step < self._count:
            i = (i - step) % SIZE
            if difference(self._times[i], time_us) < 0:
                i = self._newest
        before = (i - 1) % SIZE
        while difference(self._times[before], time_us) > 0:
            i = before
            before = (i - 1) % SIZE
        begin = self._times[before]
        share = difference(time_us, begin) / difference(self._times[i], begin)
        for k in range(COLUMNS):
            column = self._columns[k]
            start = column[before]
            out[k] = (start + round(share * difference(column[i], start))) & MASK
        return True
