"""The mean reading of one still pose, with a check that it was still.

Sums are kept as integers until the end: 32-bit floats would lose the digits that averaging gains.
"""

from ..errors import CaptureError

# Largest difference of a sample from the first one: more is a knock. Ten times the chip's noise with its widest filter.
PEAK_G = 0.08
PEAK_DPS = 5.0
SPREAD_G = 0.02  # largest standard deviation: being still matters more than the exact angle of a pose
DRIFT_G = 0.007  # largest difference between the means of both halves: 0.4 degrees of slow tilt
MAX_REST_RATE_DPS = 45.0  # the data sheet allows 20 deg/s of gyro offset, and as much again over temperature
MIN_SAMPLES = 20

_AXES = (0, 1, 2, 4, 5, 6)  # accelerometer and gyro in the chip's order; 3 is the temperature


class StillPose:
    """Averages the samples of one pose.

    accel_lsb_per_g, gyro_lsb_per_dps: counts per unit. accel_limit: |counts| from which on an axis is saturated.
    expected: number of samples to come; the check for drift compares their halves.
    count: samples taken. problem: a CaptureError once the pose is spoilt, or None.
    After finish(): accel (3, g, sensor's axes, uncalibrated), gyro (3, deg/s).
    """

    def __init__(self, accel_lsb_per_g, gyro_lsb_per_dps, accel_limit, expected):
        self._accel_lsb = accel_lsb_per_g
        self._gyro_lsb = gyro_lsb_per_dps
        self._limit = accel_limit
        self._half = expected // 2
        accel_peak = int(PEAK_G * accel_lsb_per_g)
        gyro_peak = int(PEAK_DPS * gyro_lsb_per_dps)
        self._peaks = (accel_peak, accel_peak, accel_peak, 0, gyro_peak, gyro_peak, gyro_peak)
        self._first = [0] * 7
        self._sums = [0] * 7  # sums of the deviations from the first sample, so that they stay small integers
        self._early = [0] * 7  # the sums at half time
        self._squares = [0] * 7
        self.count = 0
        self.problem = None
        self.accel = None
        self.gyro = None

    def add(self, counts):
        """Take one sample (7 integers, the chip's order). False once the pose is spoilt."""
        if self.problem is not None:
            return False
        if self.count == 0:
            for i in range(7):
                self._first[i] = counts[i]
        for i in _AXES:
            deviation = counts[i] - self._first[i]
            if not -self._peaks[i] <= deviation <= self._peaks[i]:
                self.problem = CaptureError("moved")
                return False
            if i < 3 and not -self._limit < counts[i] < self._limit:
                self.problem = CaptureError("saturated")
                return False
            self._sums[i] += deviation
            self._squares[i] += deviation * deviation
        self.count += 1
        if self.count == self._half:
            for i in range(7):
                self._early[i] = self._sums[i]
        return True

    def finish(self):
        """Check the whole pose, and set accel and gyro. Raises CaptureError."""
        if self.problem is None:
            self.problem = self._judge()
        if self.problem is not None:
            raise self.problem
        n = self.count
        mean = [self._first[i] + self._sums[i] / n for i in range(7)]
        self.accel = [mean[i] / self._accel_lsb for i in range(3)]
        self.gyro = [mean[i] / self._gyro_lsb for i in range(4, 7)]

    def _judge(self):
        n = self.count
        if n < MIN_SAMPLES:
            return CaptureError("too-few", n, MIN_SAMPLES)
        if not any(self._squares):
            return CaptureError("frozen-pose")
        late = n - self._half
        for i in range(3):
            mean = self._sums[i] / n
            if self._squares[i] / n - mean * mean > (SPREAD_G * self._accel_lsb) ** 2:
                return CaptureError("vibration")
            drift = (self._sums[i] - self._early[i]) / late - self._early[i] / self._half
            if abs(drift) > DRIFT_G * self._accel_lsb:
                return CaptureError("tilting")
        for i in range(4, 7):
            if abs(self._first[i] + self._sums[i] / n) > MAX_REST_RATE_DPS * self._gyro_lsb:
                return CaptureError("gyro-offset", MAX_REST_RATE_DPS)
        return None
