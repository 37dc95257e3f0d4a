"""Do the parts of a drive agree about forward and about the vertical? If not, the mount may have moved between them.

Each way to part the drive in two is looked at, because nobody knows when it moved. How far two parts may differ by
chance follows from how far the blocks within each differ: the error of one falls with the root of its weight, down to
what a road's camber and wind do to a long stretch of it. Of a few blocks the scatter is not known well: what is usual
counts like USUAL more.
"""

from array import array
from math import atan2, degrees, pi, sqrt

from .regression import BLOCKS

USUAL_DEG = 1.0  # of forward, at a weight of 1 g^2 s
USUAL = 4  # blocks
STRETCH_DEG = 1.5
MIN_WEIGHT = 0.1  # g^2 s, in a part
MIN_S = 20.0  # of straight driving in a part
MIN_BLOCKS = 4


def apart(a, b):
    """Angle between two directions, 0 to pi."""
    between = abs(a - b)
    return min(between, 2 * pi - between)


def usual(scatter, weight, free):
    """Variance (deg^2) of a mean, of its own with so many degrees of freedom, and of what is usual."""
    return (free * scatter + USUAL * USUAL_DEG * USUAL_DEG / weight) / (free + USUAL)


class DriveParts:
    """clear(), add() each block, compare(). Then, for the two parts that differ most beyond chance: forward_deg, by
    how much; sigmas, of what chance does. roll_deg, pitch_deg: the most that the vertical differs between two parts.
    """

    def __init__(self):
        self._blocks = [array("f", [0.0] * 6) for _ in range(BLOCKS)]
        self.clear()

    def clear(self):
        """Before the first add()."""
        self.count = 0
        self.forward_deg = self.sigmas = self.roll_deg = self.pitch_deg = 0.0

    def add(self, across, along, roll_g, pitch_g, weight, seconds):
        """A block's forward, across and along that of the whole drive; its vertical, likewise."""
        block = self._blocks[self.count]
        self.count += 1
        block[0], block[1] = weight * across, weight * along
        block[2], block[3] = seconds * roll_g, seconds * pitch_g
        block[4], block[5] = weight, seconds

    def compare(self):
        """A generator of short pieces."""
        one, two = [0.0] * 7, [0.0] * 7
        for first in range(1, self.count):
            self._gather(one, 0, first)
            yield
            self._gather(two, first, self.count)
            yield
            if one[5] >= MIN_S and two[5] >= MIN_S:
                self.roll_deg = max(self.roll_deg, degrees(abs(one[2] / one[5] - two[2] / two[5])))
                self.pitch_deg = max(self.pitch_deg, degrees(abs(one[3] / one[5] - two[3] / two[5])))
            if self.count < MIN_BLOCKS or one[4] < MIN_WEIGHT or two[4] < MIN_WEIGHT:
                continue
            angle, other = atan2(one[0], one[1]), atan2(two[0], two[1])
            scatter = self._scatter(angle, 0, first)
            yield
            scatter += self._scatter(other, first, self.count)
            yield
            free = self.count - 2
            variance = STRETCH_DEG * STRETCH_DEG * (one[6] / (one[4] * one[4]) + two[6] / (two[4] * two[4]))
            variance += usual(scatter / one[4] / free, one[4], free) + usual(scatter / two[4] / free, two[4], free)
            between = degrees(apart(angle, other))
            if between > self.sigmas * sqrt(variance):
                self.sigmas = between / sqrt(variance)
                self.forward_deg = between
            yield

    def _gather(self, sums, first, last):
        """Sums over some blocks; the last one of weight squared."""
        for i in range(7):
            sums[i] = 0.0
        for k in range(first, last):
            block = self._blocks[k]
            for i in range(6):
                sums[i] += block[i]
            sums[6] += block[4] * block[4]

    def _scatter(self, angle, first, last):
        """Sum over some blocks of weight times (deg^2) from an angle."""
        total = 0.0
        for k in range(first, last):
            block = self._blocks[k]
            off = degrees(apart(angle, atan2(block[0], block[1])))
            total += block[4] * off * off
        return total
