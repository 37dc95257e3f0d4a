"""Keeps force and yaw rate of the last seconds. A speed arrives late and must be compared with earlier readings.

The history stores running integrals as integers that wrap. The difference of two integers stays exact in a long drive,
while float32 sums lose digits as they grow. Integers also need no heap.
"""

from array import array

BIN_US = 100_000
SIZE = 64  # number of bins, enough for the lag of a speed, the interval before the speed, and the time to process them
MASK = 0x1FFFFFFF
_HALF = 0x10000000
COLUMNS = 4  # three integrals of the force in 1e-6 g s, and one integral of the yaw rate in 1e-5 degrees


def difference(a, b):
    """Return a - b for values that wrap."""
    return ((a - b + _HALF) & MASK) - _HALF


class ForceHistory:
    """A ring of running integrals of force and yaw rate, with one entry for the end of each bin.

    Attributes:
        now: the time at the end of the newest bin in us. This time is the sum of all bins' lengths, and wraps at MASK.
    """

    def __init__(self):
        self._times = array("i", [0] * SIZE)
        self._columns = [array("i", [0] * SIZE) for _ in range(COLUMNS)]
        self._total = [0] * COLUMNS
        self._newest = 0
        self._count = 1  # number of entries that can be looked up
        self.now = 0

    def clear(self):
        """Drop all entries, because samples are missing. A difference of integrals must not span the gap."""
        self._count = 1

    def add(self, force_us, yaw, dt_us):
        """Add a bin.

        Args:
            force_us: integral of the force over the bin, 3 values in g us.
            yaw: integral of the yaw rate over the bin, in 1e-5 degrees.
            dt_us: length of the bin.
        """
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
        """Look up the integrals at a time, interpolated within its bin.

        Args:
            out: list of COLUMNS integers for the integrals.
            time_us: the time on the clock of `now`.

        Returns:
            False if the time is not in the history.
        """
        behind = difference(self.now, time_us)
        if behind < 0 or behind >= difference(self.now, self._times[(self._newest - self._count + 1) % SIZE]):
            return False
        # A bin may be longer than BIN_US, but hardly twice as long. So start the search half as many bins back as bins
        # of BIN_US would need.
        i = self._newest
        step = behind // (2 * BIN_US)
        if step < self._count:
            i = (i - step) % SIZE
            if difference(self._times[i], time_us) < 0:
                i = self._newest
        previous = (i - 1) % SIZE
        while difference(self._times[previous], time_us) > 0:
            i = previous
            previous = (i - 1) % SIZE
        begin = self._times[previous]
        share = difference(time_us, begin) / difference(self._times[i], begin)
        for k in range(COLUMNS):
            column = self._columns[k]
            start = column[previous]
            out[k] = (start + round(share * difference(column[i], start))) & MASK
        return True
