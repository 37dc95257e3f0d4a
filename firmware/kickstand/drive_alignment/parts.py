"""Compares forward and the vertical between two parts of a drive. If forward or the vertical differs, the mount may
have moved between the two parts.

The time of a move is unknown, so the drive is split in two after each block, one block after the other. The scatter of
forward between the blocks within each part shows which difference is likely by chance. The variance of a part's forward
falls with the part's weight, but not below the effect of camber and wind on one long stretch of road. A few blocks give
a poor sample variance, so it is averaged with a prior of PRIOR_FREEDOM degrees of freedom.
"""

from array import array
from math import atan2, degrees, pi, sqrt

from ..units import const
from .regression import BLOCKS

PRIOR_DEG = 1.0  # prior of the standard deviation of forward, at a weight of 1 g^2 s
PRIOR_FREEDOM = 4
# Standard deviation of forward that camber and wind cause on one stretch of road. This part does not depend on the
# weight.
STRETCH_DEG = 1.5
_MIN_WEIGHT = const(0.1)  # the forward of a part with a smaller weight (g^2 s) is not compared
_MIN_S = const(20.0)  # the vertical of a part with less straight driving is not compared
_MIN_BLOCKS = const(4)  # with fewer blocks in the drive, forward is not compared


def angle_between(a, b):
    """Return the angle between two directions in rad, from 0 to pi.

    Args:
        a, b: the directions as angles in rad.
    """
    angle = abs(a - b)
    return min(angle, 2 * pi - angle)


def blend_prior(variance, weight, freedom):
    """Average the sample variance of forward with its prior variance. Return the result in deg^2.

    Args:
        variance: the sample variance in deg^2.
        weight: weight of the events that forward was computed from, in g^2 s.
        freedom: degrees of freedom of the sample variance.
    """
    return (freedom * variance + PRIOR_FREEDOM * PRIOR_DEG * PRIOR_DEG / weight) / (freedom + PRIOR_FREEDOM)


class DriveParts:
    """Compares the parts of a drive. Call clear(), add() each block in chronological order, and run compare() to its
    end.

    Attributes, after compare():
        forward_deg: difference of forward between the two parts, for the split with the most significant difference.
        sigmas: the same difference in standard deviations.
        roll_deg, pitch_deg: largest differences of the vertical between the two parts, over all splits.
        count: number of blocks.
    """

    def __init__(self):
        self._blocks = [array("f", [0.0] * 6) for _ in range(BLOCKS)]
        self.clear()

    def clear(self):
        """Drop all blocks. Call this method before the first add()."""
        self.count = 0
        self.forward_deg = self.sigmas = self.roll_deg = self.pitch_deg = 0.0

    def add(self, across, along, roll_g, pitch_g, weight, seconds):
        """Add one block of events.

        The components are relative to forward of the whole drive.

        Args:
            across, along: the components of the block's forward to the left and forward, in g per g.
            roll_g, pitch_g: the components of the block's vertical to the left and forward, in g.
            weight, seconds: as in the block's Fit.
        """
        block = self._blocks[self.count]
        self.count += 1
        block[0], block[1] = weight * across, weight * along
        block[2], block[3] = seconds * roll_g, seconds * pitch_g
        block[4], block[5] = weight, seconds

    def compare(self):
        """Compare the two parts of each split, as a generator of short steps."""
        first, second = [0.0] * 7, [0.0] * 7
        for split in range(1, self.count):
            self._sum(first, 0, split)
            yield
            self._sum(second, split, self.count)
            yield
            if first[5] >= _MIN_S and second[5] >= _MIN_S:
                self.roll_deg = max(self.roll_deg, degrees(abs(first[2] / first[5] - second[2] / second[5])))
                self.pitch_deg = max(self.pitch_deg, degrees(abs(first[3] / first[5] - second[3] / second[5])))
            if self.count < _MIN_BLOCKS or first[4] < _MIN_WEIGHT or second[4] < _MIN_WEIGHT:
                continue
            first_angle, second_angle = atan2(first[0], first[1]), atan2(second[0], second[1])
            scatter = self._scatter(first_angle, 0, split)
            yield
            scatter += self._scatter(second_angle, split, self.count)
            yield
            freedom = self.count - 2  # two degrees of freedom less, because the scatter is about two means
            variance = (
                STRETCH_DEG * STRETCH_DEG * (first[6] / (first[4] * first[4]) + second[6] / (second[4] * second[4]))
            )
            sampled = blend_prior(scatter / first[4] / freedom, first[4], freedom)
            sampled += blend_prior(scatter / second[4] / freedom, second[4], freedom)
            variance += sampled
            difference_deg = degrees(angle_between(first_angle, second_angle))
            if difference_deg > self.sigmas * sqrt(variance):
                self.sigmas = difference_deg / sqrt(variance)
                self.forward_deg = difference_deg
            yield

    def _sum(self, sums, first, last):
        """Add up the blocks from first to last - 1. Write the 6 sums of the blocks' values and the sum of the squared
        weights into sums."""
        for i in range(7):
            sums[i] = 0.0
        for k in range(first, last):
            block = self._blocks[k]
            for i in range(6):
                sums[i] += block[i]
            sums[6] += block[4] * block[4]

    def _scatter(self, angle, first, last):
        """Return the scatter of forward about an angle: the sum of weight times squared deviation in deg^2, over the
        blocks from first to last - 1."""
        total = 0.0
        for k in range(first, last):
            block = self._blocks[k]
            off = degrees(angle_between(angle, atan2(block[0], block[1])))
            total += block[4] * off * off
        return total
