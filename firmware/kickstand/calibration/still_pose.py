"""Averages the readings of one pose, and checks that the sensor was still.

A dead sensor must not be accepted as a still sensor. Because a working axis has noise, each axis must change by a count
from time to time. A gyro axis must not be too noisy.

The sums are integers, because 32-bit floats would lose the digits that averaging gains.
"""

from ..errors import CaptureError, SickSensor
from ..units import AXES, const

# Largest difference between a sample and the first sample. A larger difference is a knock. The limits of force and rate
# are ten times the chip's noise with its widest filter.
_PEAK_G = const(0.08)
_PEAK_DPS = const(5.0)
# Largest noise of a gyro axis, fifteen times the chip's noise with its usual filter. The noise is computed from the
# differences between successive samples. A slow sway of the hand hardly changes these differences.
_NOISE_DPS = const(0.6)
_SPREAD_G = const(0.02)  # largest standard deviation of an axis of the accelerometer
_DRIFT_G = const(0.007)  # largest change of force between the two halves of the pose, equal to a tilt of 0.4 degrees
# The gyro at rest; the data sheet allows an offset of 20 deg/s, plus 20 deg/s over temperature
_MAX_REST_RATE_DPS = const(45.0)
_MIN_SAMPLES = const(20)

_AXES = (0, 1, 2, 4, 5, 6)  # indices of accelerometer and gyro in a sample; index 3 is the temperature


class StillPose:
    """Averages the samples of one pose.

    Do not use a pose after a CaptureError.

    Args:
        accel_lsb_per_g: counts per g.
        gyro_lsb_per_dps: counts per deg/s.
        accel_limit: absolute counts from which an axis of the accelerometer is saturated.
        expected: number of samples in the pose. The check for drift compares the two halves of the pose.

    Attributes:
        count: number of samples taken so far.
        accel: the mean force, 3 values in g, in the sensor's axes, uncalibrated; None before finish().
        gyro: the mean rate, 3 values in deg/s; None before finish().
    """

    def __init__(self, accel_lsb_per_g, gyro_lsb_per_dps, accel_limit, expected):
        self._accel_lsb = accel_lsb_per_g
        self._gyro_lsb = gyro_lsb_per_dps
        self._limit = accel_limit
        self._half = expected // 2
        accel_peak = int(_PEAK_G * accel_lsb_per_g)
        gyro_peak = int(_PEAK_DPS * gyro_lsb_per_dps)
        self._peaks = (accel_peak, accel_peak, accel_peak, 0, gyro_peak, gyro_peak, gyro_peak)
        self._first = [0] * 7
        # A deviation is the difference between a sample and the first sample, a small integer.
        self._sums = [0] * 7  # sums of the deviations
        self._early = [0] * 7  # sums of the deviations in the first half of the pose
        self._squares = [0] * 7  # sums of the squared deviations
        self._last = [0] * 7  # deviations of the last sample
        self._changes = [0] * 7  # sums of the squared differences between successive deviations
        self.count = 0
        self.accel = None
        self.gyro = None

    def add(self, counts):
        """Take one sample of 7 counts in the chip's order. Raises CaptureError."""
        if self.count == 0:
            for i in range(7):
                self._first[i] = counts[i]
        for i in _AXES:
            deviation = counts[i] - self._first[i]
            if not -self._peaks[i] <= deviation <= self._peaks[i]:
                raise CaptureError("moved")
            if i < 3 and not -self._limit < counts[i] < self._limit:
                raise CaptureError("saturated")
            change = deviation - self._last[i]
            self._last[i] = deviation
            self._changes[i] += change * change
            self._sums[i] += deviation
            self._squares[i] += deviation * deviation
        self.count += 1
        if self.count == self._half:
            for i in range(7):
                self._early[i] = self._sums[i]

    def finish(self):
        """Check the whole pose, and set accel and gyro. Raises CaptureError."""
        n = self.count
        if n < _MIN_SAMPLES:
            raise CaptureError("too-few", n, _MIN_SAMPLES)
        if not any(self._squares):
            raise CaptureError("frozen-pose")
        for i in range(3):
            if not self._squares[i]:
                raise SickSensor("stuck-accel", AXES[i])
            if not self._squares[4 + i]:
                raise SickSensor("dead-gyro", AXES[i])
            if self._changes[4 + i] > 2 * n * (_NOISE_DPS * self._gyro_lsb) ** 2:
                raise SickSensor("noisy-gyro", AXES[i])
        late = n - self._half
        for i in range(3):
            off = self._sums[i] / n
            if self._squares[i] / n - off * off > (_SPREAD_G * self._accel_lsb) ** 2:
                raise CaptureError("vibration")
            drift = (self._sums[i] - self._early[i]) / late - self._early[i] / self._half
            if abs(drift) > _DRIFT_G * self._accel_lsb:
                raise CaptureError("tilting")
        mean = [self._first[i] + self._sums[i] / n for i in range(7)]
        accel = [mean[i] / self._accel_lsb for i in range(3)]
        gyro = [mean[i] / self._gyro_lsb for i in range(4, 7)]
        if max(abs(rate) for rate in gyro) > _MAX_REST_RATE_DPS:
            raise CaptureError("gyro-offset", _MAX_REST_RATE_DPS)
        self.accel, self.gyro = accel, gyro
