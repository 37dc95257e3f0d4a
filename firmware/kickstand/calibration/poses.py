"""The still poses of a guided calibration, the turns of the sensor between them, and the alignment by two poses, on the
kickstand and upright (A. Nicolae, section 2).

A StillPose averages the readings of one pose, and checks that the sensor was still. A dead sensor must not be accepted
as a still sensor. Because a working axis has noise, each axis must change by a count from time to time. A gyro axis
must not be too noisy. The sums are integers, because 32-bit floats would lose the digits that averaging gains.

A Turn computes from the gyro how the sensor turned between two poses, and how the gyro's errors change the result.
Gravity in the poses before and after shows the same turn, so the poses calibrate the gyro. A Turn keeps two matrices:

* R (3x3) rotates vectors from the sensor's axes now to its axes at the start.
* S (3x12) gives the effect of the gyro's errors. If the true rate is (I + X) rate + c, the true rotation is
  exp([S x]) R. The vector x has row i of X and then c_i in the entries 4 i to 4 i + 3, for i from 0 to 2.

With R and S no samples need to be kept. The method of D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to
implement method for IMU calibration", ICRA 2014, keeps all samples.
"""

from array import array
from math import atan2, cos, degrees, radians, sin

from ..errors import CaptureError, Refusal, SickSensor
from ..rotation import matrix, rotate, vector
from ..units import AXES, const
from .vectors import cross, dot, frame, norm, normalize

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

# a step of the integration ends when the sensor has turned by this angle about one axis; a smaller angle is more exact
_STEP_RAD = const(0.02)
_STEP_US = const(60_000)  # longest duration of a step
# 0.95 of the gyro's range, in counts. The limit is below the full range, because the low-pass of the chip hides single
# readings at the end of the range.
_QUICK = const(31_000)
# Smallest tilt between the poses. If the pitch changes by one degree between the poses, the yaw error is 11 degrees at
# a tilt of 5 degrees, and 7 degrees at a tilt of 8 degrees.
_MIN_TILT_DEG = const(5.0)
WARN_TILT_DEG = 8.0
_MAX_TILT_DEG = const(60.0)
_SAME_POSE_DEG = const(1.0)
# Largest difference between a reading at rest and 1 g. The data sheet allows 80 mg of offset and 3 % of scale error,
# plus drift. After the six positions only 35 mg of drift over temperature remain.
_UNCALIBRATED_TOLERANCE_G = const(0.15)
_CALIBRATED_TOLERANCE_G = const(0.05)
# Largest difference between the turn by the gyro and the tilt between the poses. The limit is the sum of these terms:
# * GYRO_RAD, a constant in rad
# * GYRO_TILT_SHARE times the tilt, for uncalibrated sensors and the gyro's scale error
# * GYRO_TURN_SHARE times the whole turn, for cross-axis errors, for example while the bike is pushed about
# * GYRO_DRIFT, the drift of the gyro's bias in rad/s, times the duration
# * three standard deviations of the angle that the random walk of the gyro's bias causes; GYRO_WALK is in rad/s per
#   sqrt(s)
GYRO_RAD, GYRO_TILT_SHARE, GYRO_TURN_SHARE = 0.02, 0.15, 0.04
GYRO_DRIFT, GYRO_WALK = 0.0005, 0.0002


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


def check_one_g(force, tolerance_g, pose):
    """Raise Refusal unless the length of the force is within tolerance_g of 1 g.

    Args:
        force: 3 values in g.
        tolerance_g: the largest difference from 1 g.
        pose: "kickstand" or "upright", for the message.
    """
    size = norm(force)
    if not abs(size - 1.0) <= tolerance_g:
        raise Refusal("not-one-g", pose, size)


def two_position(out, kickstand, upright, side="left", tolerance_g=_UNCALIBRATED_TOLERANCE_G):
    """Compute the rotation from sensor axes to vehicle axes by two poses, with Nicolae's equations 3-8. Raises Refusal.

    The function differs from the paper in three points:
    * Equation (4) is the cross product of the upright and the tilted reading. As printed, the product is zero.
    * Equation (5) takes y from the upright reading and divides y by its own length.
    * If the kickstand is on the right, the paper's x and z point right and backward. So the signs of x and z are
      changed.

    Args:
        out: array of 9 for the rotation matrix, with the rows left, up, forward.
        kickstand: mean specific force on the kickstand, 3 values in g, in the sensor's axes.
        upright: mean specific force in the upright pose, 3 values in g, in the sensor's axes.
        side: "left" or "right", the side to which the kickstand leans the bike.
        tolerance_g: largest difference between each force and 1 g.

    Returns:
        The tilt between the poses in degrees.
    """
    check_one_g(kickstand, tolerance_g, "kickstand")
    check_one_g(upright, tolerance_g, "upright")
    y, tilted = vector(*upright), vector(*kickstand)
    normalize(y)
    normalize(tilted)
    z = vector()
    cross(z, y, tilted)
    tilt = degrees(atan2(norm(z), dot(y, tilted)))
    if tilt < _SAME_POSE_DEG:
        raise Refusal("same-pose", tilt)
    if tilt < _MIN_TILT_DEG:
        raise Refusal("tilt-small", tilt, _MIN_TILT_DEG)
    if tilt > _MAX_TILT_DEG:
        raise Refusal("tilt-large", tilt, _MAX_TILT_DEG)
    if side == "right":
        z[0], z[1], z[2] = -z[0], -z[1], -z[2]
    frame(out, y, z)
    return tilt


def align(calibration, kickstand, upright, side, turn=None):
    """Align a Calibration by two poses. Raises Refusal.

    The gyro's bias is taken from the kickstand pose, because a stand holds the bike stiller than a rider does.

    Args:
        calibration: a Calibration with offset and slope.
        kickstand, upright: the two finished poses, each a StillPose.
        side: "left" or "right", the side to which the kickstand leans the bike.
        turn: the ended Turn between the poses, which must agree with the tilt between them, or None.

    Returns:
        calibration: a new, aligned Calibration.
        tilt: the tilt between the poses in degrees.
    """
    vehicle_from_sensor = matrix()
    poses = _force(calibration, kickstand.accel), _force(calibration, upright.accel)
    tolerance_g = _CALIBRATED_TOLERANCE_G if calibration.six_done else _UNCALIBRATED_TOLERANCE_G
    tilt = two_position(vehicle_from_sensor, *poses, side, tolerance_g)
    if turn and not turn.lost:
        _check_turn(*poses, radians(tilt), upright.gyro, turn)
    return calibration.with_alignment(vehicle_from_sensor, kickstand.gyro), tilt


def _force(calibration, accel):
    """Calibrate a mean reading of the accelerometer (3 values, in g). Return the force as a new vector."""
    force = vector()
    slope, offset = calibration.accel_slope, calibration.accel_offset
    rotate(force, calibration.accel_matrix, [slope[i] * accel[i] + offset[i] for i in range(3)])
    return force


def _check_turn(u, v, tilt, bias, turn):
    """Raise SickSensor unless the gyro's turn between the two poses agrees with the tilt between them.

    The longer the turn took, the more difference is allowed. After a minute the check hardly limits a tilt of 12
    degrees.

    Args:
        u, v: the forces on the kickstand and upright, which are made 1 long.
        tilt: the tilt between them, in rad.
        bias: the gyro's bias in the upright pose, 3 values in deg/s.
        turn: the ended Turn.
    """
    normalize(u)
    normalize(v)
    axis, inverse, claimed = vector(), vector(), vector()
    misfit = 9.9
    # Try two biases. The bias of the kickstand pose is better without drift, because a stand holds the bike stiller.
    # The mean bias of both poses is better if the bias has drifted.
    for share in (0.0, 0.5):
        r = turn.attitude(bias, share)
        rotate(inverse, r, v)
        misfit = min(misfit, norm([u[i] - inverse[i] for i in range(3)]))
    seconds = turn.seconds
    tolerance = GYRO_RAD + GYRO_TILT_SHARE * tilt + GYRO_TURN_SHARE * turn.angle()
    tolerance += GYRO_DRIFT * seconds + GYRO_WALK * (seconds**3 / 3) ** 0.5
    if misfit > tolerance:
        rotate(claimed, (r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]), u)
        cross(axis, u, v)
        normalize(axis)
        cross(inverse, u, claimed)
        raise SickSensor("gyro-tilt", degrees(tilt), degrees(atan2(dot(inverse, axis), dot(u, claimed))))
