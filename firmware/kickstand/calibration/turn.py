"""Computes from the gyro how a sensor turned between two still poses, and how the gyro's errors change the result.

Gravity in the poses before and after shows the same turn, so the poses calibrate the gyro. A Turn keeps two matrices:

* R (3x3) rotates vectors from the sensor's axes now to its axes at the start.
* S (3x12) gives the effect of the gyro's errors. If the true rate is (I + X) rate + c, the true rotation is
  exp([S x]) R. The vector x has row i of X and then c_i in the entries 4 i to 4 i + 3, for i from 0 to 2.

With R and S no samples need to be kept. The method of D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to
implement method for IMU calibration", ICRA 2014, keeps all samples.
"""

from array import array
from math import cos, radians, sin

from ..units import const

# a step of the integration ends when the sensor has turned by this angle about one axis; a smaller angle is more exact
_STEP_RAD = const(0.02)
_STEP_US = const(60_000)  # longest duration of a step
# 0.95 of the gyro's range, in counts. The limit is below the full range, because the low-pass of the chip hides single
# readings at the end of the range.
_QUICK = const(31_000)


class Turn:
    """Integrates the gyro from start() to end(), with fixed memory.

    Args:
        lsb_per_dps: counts per deg/s.
        period_us: nominal time between two samples.
        quick: a rate with this absolute value in counts, or more, is too fast.

    Attributes:
        quick: True if the rate was too fast at any time since start().
        lost: True if readings were missing since start().
        seconds: duration of the turn, after end().
        running: True between start() and end().
    """

    def __init__(self, lsb_per_dps, period_us, quick=_QUICK):
        self._rad = radians(1.0 / lsb_per_dps) * 1e-6  # rad per count and microsecond
        self._lsb = lsb_per_dps
        self._period_us = period_us
        self._quick = quick
        self._step_counts = int(_STEP_RAD / self._rad / period_us)  # sum of counts that equals _STEP_RAD
        self.running = False

    def start(self, bias):
        """Begin a turn at a still pose.

        Args:
            bias: the gyro's bias in this pose, 3 values in deg/s.
        """
        self._bias = [value * self._lsb for value in bias]
        self.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        self.s = [0.0] * 36
        self._sums = [0, 0, 0]
        self._n = self._us = 0
        self.seconds = 0.0
        self.quick = self.lost = self._held = False
        self.running = True

    def add(self, sums, n, dt_us, hold=False):
        """Take n samples.

        Args:
            sums: sums of the samples' counts in the chip's order, 7 values.
            n: number of samples.
            dt_us: microseconds since the previous samples.
            hold: True if the samples belong to a still pose that may end the turn. The samples are added to the turn
                only if that pose fails.
        """
        if not self.running:
            return
        if hold and not self._held and self._n:
            self._step()
        self._held = hold
        if dt_us > (n + 3) * self._period_us:
            self.lost = True
        quick, sums_of_turn = n * self._quick, self._sums
        step = False
        for i in range(3):
            total = sums[4 + i]
            if not -quick < total < quick:
                self.quick = True
            sums_of_turn[i] += total
            if not -self._step_counts < sums_of_turn[i] < self._step_counts:
                step = True
        self._n += n
        self._us += dt_us
        if (step or self._us > _STEP_US) and not hold:
            self._step()

    def end(self):
        """End the turn at a still pose."""
        if self._n and not self._held:
            self._step()
        self.running = False

    def attitude(self, bias, share):
        """Return R as a list of 9, corrected for a bias that differs from the bias of start().

        Args:
            bias: the gyro's bias in another pose, 3 values in deg/s.
            share: weight of `bias` in the mean of the two biases. At 0 the bias of start() is used, at 1 `bias`.
        """
        turned, out = [0.0] * 3, self.r[:]
        for i in range(3):
            error = radians(share * (self._bias[i] / self._lsb - bias[i]))
            for a in range(3):
                turned[a] += self.s[12 * a + 4 * i + 3] * error
        for i in range(3):
            column = rotated(turned, self.r[i::3])
            for a in range(3):
                out[3 * a + i] = column[a]
        return out

    def packed(self, bias):
        """Return the turn for SensorFit, with the mean of the biases at both ends.

        Args:
            bias: the gyro's bias in the pose at the end, 3 values in deg/s.

        Returns:
            array('f', 36): R (9 values), then S without the columns of the bias (27 values).
        """
        out = array("f", self.attitude(bias, 0.5))
        for i in range(36):
            if i % 4 != 3:
                out.append(self.s[i])
        return out

    def angle(self):
        """Return the angle of the turn by the gyro, in rad."""
        total = 0.0
        for a in range(0, 36, 12):
            turned = self.s[a] + self.s[a + 5] + self.s[a + 10]
            total += turned * turned
        return total**0.5

    def _step(self):
        """Advance R and S by the sums of counts.

        [w] is the cross-product matrix of the rotation w. A row of R times [w] is the cross product of the row and w.
        The half step makes the integration second-order."""
        share, total, bias, n = self._rad * self._us / self._n, self._sums, self._bias, self._n
        x, y, z = [share * (total[i] - n * bias[i]) for i in range(3)]
        seconds = self._us * 1e-6
        self.seconds += seconds
        total[0] = total[1] = total[2] = 0
        self._n = self._us = 0
        steps = (x, y, z, seconds)
        small = 1.0 - (x * x + y * y + z * z) / 6  # with this factor the angle is correct to the fifth order
        x, y, z = small * x, small * y, small * z
        r, s = self.r, self.s
        for a in range(3):
            p, q, t = r[3 * a], r[3 * a + 1], r[3 * a + 2]
            half = p + 0.5 * (q * z - t * y), q + 0.5 * (t * x - p * z), t + 0.5 * (p * y - q * x)
            r[3 * a] = p + half[1] * z - half[2] * y
            r[3 * a + 1] = q + half[2] * x - half[0] * z
            r[3 * a + 2] = t + half[0] * y - half[1] * x
            index = 12 * a
            for value in half:
                for step in steps:
                    s[index] += value * step
                    index += 1


def rotated(turned, vector):
    """Rotate a vector by O. Rodrigues' formula. Return a new list.

    Args:
        turned: the rotation vector, 3 values in rad.
        vector: 3 values.
    """
    x, y, z = turned
    p, q, t = vector
    square = x * x + y * y + z * z
    if square < 1e-12:
        return [p + y * t - z * q, q + z * p - x * t, t + x * q - y * p]
    angle = square**0.5
    across, along, by = sin(angle) / angle, (1.0 - cos(angle)) / square * (x * p + y * q + z * t), cos(angle)
    return [
        by * p + across * (y * t - z * q) + along * x,
        by * q + across * (z * p - x * t) + along * y,
        by * t + across * (x * q - y * p) + along * z,
    ]
