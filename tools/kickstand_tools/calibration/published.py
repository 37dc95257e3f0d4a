"""Alignment by driving as ViriCiti published it: R = R2 R1, each a rotation by Rodrigues' formula.

R1 rotates the mean direction of gravity at the stops to up. R2 rotates the mean force of the braking events, levelled
by R1, to backward. A braking event counts if the directions of its levelled force spread little. A remaining tilt of
the vertical by the stops makes a yaw error of some 3 to 4 degrees, which more braking events do not reduce. The
firmware's DriveAlignment does not have this error; the published method is here for comparison.
"""

from math import degrees, sqrt

from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand.drive_alignment.events import MAX_INTERVAL_US, MIN_INTERVAL_US
from kickstand.rotation import dot, matrix, normalize, rotate, vector
from kickstand.units import GAP_US

MAX_DISPERSION = 0.02  # 8 degrees
MIN_LEVEL_G = 0.03  # a smaller levelled force points anywhere
BRAKING_MPS2 = -1.0  # an interval with more deceleration belongs to a braking event
MEAN_US = 100_000
LOSS_MPS = 1.5  # a braking event that reduces the speed by less is noise
MIN_EVENTS = 3
UP = (0.0, 1.0, 0.0)
BACKWARD = (0.0, 0.0, -1.0)
NO_MEAN = 9.9  # where there is no mean direction, as of opposite ones; also the largest value given


def rotation_between(out, a, b, axis):
    """Fill out (9, row-major) with the rotation that takes unit vector a to unit vector b (O. Rodrigues).

        R = I + K + K^2 / (1 + c),  K the cross product matrix of a x b, c = a . b

    In float32 this is 2 degrees off where a and b are 179.9 degrees apart, and fails nearer to 180. So where c < 0, a
    half turn D about a coordinate axis comes first, after which c > 0: R = Rodrigues(D a, b) D. Its error is under 2e-7
    everywhere.

    axis: 0, 1 or 2, the coordinate axis of the half turn; it has to be perpendicular to b.
    """
    signs = [1.0, 1.0, 1.0]
    if dot(a, b) < 0.0:
        signs = [-1.0, -1.0, -1.0]
        signs[axis] = 1.0
    x, y, z = signs[0] * a[0], signs[1] * a[1], signs[2] * a[2]
    p = y * b[2] - z * b[1]
    q = z * b[0] - x * b[2]
    r = x * b[1] - y * b[0]
    k = 1.0 / (1.0 + x * b[0] + y * b[1] + z * b[2])
    out[0] = (1.0 - k * (q * q + r * r)) * signs[0]
    out[1] = (k * p * q - r) * signs[1]
    out[2] = (k * p * r + q) * signs[2]
    out[3] = (k * p * q + r) * signs[0]
    out[4] = (1.0 - k * (p * p + r * r)) * signs[1]
    out[5] = (k * q * r - p) * signs[2]
    out[6] = (k * p * r - q) * signs[0]
    out[7] = (k * q * r + p) * signs[1]
    out[8] = (1.0 - k * (p * p + q * q)) * signs[2]


def multiply(out, a, b):
    """out (9) = A B, 3x3 matrices by rows: first the rotation B, then A. out must be neither of them."""
    for row in (0, 3, 6):
        for column in range(3):
            out[row + column] = a[row] * b[column] + a[row + 1] * b[3 + column] + a[row + 2] * b[6 + column]


class CircularDispersion:
    """How much directions in a plane spread: circular dispersion (N. I. Fisher, 1993, section 2.3). All are of equal
    weight, whatever the vectors' lengths. count: how many.

        d = (1 - rho2) / (2 R^2),  R = |mean of e^(i a)|,  rho2 = the mean cosine of 2 (a - mean direction)

    For small spreads d is about the variance in rad^2: 0.02 is 8 degrees, 0.005 is 4. Running sums are kept, so that
    rho2 needs no second pass over the directions.
    """

    def __init__(self):
        self.clear()

    def clear(self):
        """Forget all directions."""
        self.count = 0
        self._cos = self._sin = self._cos2 = self._sin2 = 0.0

    def add(self, x, y, length):
        """Add the direction of the vector (x, y). length: of that vector, > 0."""
        c, s = x / length, y / length
        self.count += 1
        self._cos += c
        self._sin += s
        self._cos2 += c * c - s * s
        self._sin2 += 2.0 * c * s

    def join(self, other):
        """Add all directions of another CircularDispersion."""
        self.count += other.count
        self._cos += other._cos
        self._sin += other._sin
        self._cos2 += other._cos2
        self._sin2 += other._sin2

    def value(self):
        """d, at most NO_MEAN."""
        r2 = self._cos * self._cos + self._sin * self._sin  # (count R)^2
        n = self.count
        if r2 <= 1e-6 * n * n:
            return NO_MEAN
        # cos 2(a - m) = cos 2a cos 2m + sin 2a sin 2m, and e^(2im) = (C + iS)^2 / r2
        cos2m = (self._cos * self._cos - self._sin * self._sin) / r2
        sin2m = 2.0 * self._cos * self._sin / r2
        rho2 = (self._cos2 * cos2m + self._sin2 * sin2m) / n
        return min(NO_MEAN, max(0.0, (1.0 - rho2) * n * n / (2.0 * r2)))


class _Samples:
    """Mean forces over MEAN_US each: their sum (3, g), and the directions of the levelled ones."""

    def __init__(self):
        self.force = [0.0] * 3
        self.directions = CircularDispersion()

    def clear(self):
        for i in range(3):
            self.force[i] = 0.0
        self.directions.clear()

    def join(self, other):
        for i in range(3):
            self.force[i] += other.force[i]
        self.directions.join(other.directions)


class PublishedAlignment:
    """Has the methods of a DriveAlignment. Runs one beside it, which checks speed and mount and finds the vertical.

    counted, turned: braking events accepted, and refused for their dispersion; needed: how many must be accepted.
    """

    def __init__(self, vehicle, up=None, bias=None):
        self._improved = DriveAlignment(vehicle, up, bias)
        self.standing = self._improved.standing
        self.needed = MIN_EVENTS
        self.counted = self.turned = 0
        self._accepted = [0.0] * 3  # sum of their forces
        self._event = _Samples()  # samples of the braking event under way
        self._interval = _Samples()  # samples since the last speed: the next speed shows whether they were braking
        self._means = CircularDispersion()  # one direction for each accepted braking event
        self._speed = -1.0
        self._loss = 0.0
        self._interval_us = 0
        self._sums = [0.0] * 3
        self._sums_us = 0
        self._up = vector()
        self._level = matrix()
        self._levelled = vector()

    @property
    def problem(self):
        """The fault of the speed or of the mount: an AlignmentError, or None."""
        return self._improved.problem

    @property
    def ready(self):
        """True once matrix() gives an alignment."""
        return self.problem is None and self.counted >= self.needed

    @property
    def quality_deg(self):
        """Standard error of the mean direction of the accepted braking events, 180 until there are two. It does not
        contain the error by a wrong vertical."""
        n = self.counted
        return degrees(sqrt(self._means.value() / n)) if n > 1 else 180.0

    @property
    def reason(self):
        """Why matrix() gives no alignment yet: an AlignmentError."""
        return self.problem or self._improved.missing(self.counted, self.needed, self.turned)

    def update(self, force, rate, dt_us):
        """Take a sample: see DriveAlignment.update()."""
        if dt_us > GAP_US:
            self.interrupt()
            return
        self._improved.update(force, rate, dt_us)
        for i in range(3):
            self._sums[i] += force[i] * dt_us
        self._sums_us += dt_us
        self._interval_us = min(self._interval_us + dt_us, MAX_INTERVAL_US + 1)
        if self._sums_us >= MEAN_US:
            for i in range(3):
                self._levelled[i] = self._sums[i] / self._sums_us
                self._sums[i] = 0.0
            self._sums_us = 0
            if self._improved.vertical.known(self._up):
                self._sample(list(self._levelled))

    def interrupt(self):
        """Samples are missing: drop the braking event under way. Accepted events stay."""
        self._improved.interrupt()
        self._forget()

    def finish(self):
        """Do all pending work at once: see DriveAlignment.finish()."""
        self._improved.finish()

    def _forget(self):
        self._event.clear()
        self._interval.clear()
        self._speed = -1.0
        self._loss = 0.0
        self._interval_us = 0
        self._sums_us = 0
        for i in range(3):
            self._sums[i] = 0.0

    def _sample(self, force):
        rotation_between(self._level, self._up, UP, 0)
        levelled = self._levelled
        rotate(levelled, self._level, force)
        size = sqrt(levelled[0] * levelled[0] + levelled[2] * levelled[2])
        if size > MIN_LEVEL_G:
            self._interval.directions.add(levelled[0], levelled[2], size)
            for i in range(3):
                self._interval.force[i] += force[i]

    def measure_speed(self, speed_mps, age_us=0):
        """Take a new speed: see DriveAlignment.measure_speed(), but the lag is not estimated."""
        self._improved.measure_speed(speed_mps, age_us)
        seconds = self._interval_us * 1e-6
        if self._interval_us < MIN_INTERVAL_US:
            return
        if self._speed < 0.0 or self._interval_us > MAX_INTERVAL_US:
            self._event.clear()
        elif (speed_mps - self._speed) / seconds < BRAKING_MPS2:
            self._event.join(self._interval)
            self._loss += self._speed - speed_mps
        elif self._event.directions.count:
            self._end_event()
        self._interval.clear()
        self._interval_us = 0
        self._speed = speed_mps

    def _end_event(self):
        loss, self._loss = self._loss, 0.0
        if loss >= LOSS_MPS and self._event.directions.value() <= MAX_DISPERSION:
            self.counted += 1
            mean = self._levelled
            for i in range(3):
                self._accepted[i] += self._event.force[i]
            rotate(mean, self._level, self._event.force)
            self._means.add(mean[0], mean[2], sqrt(mean[0] * mean[0] + mean[2] * mean[2]))
        elif loss >= LOSS_MPS:
            self.turned += 1
        self._event.clear()

    def matrix(self, out):
        """Fill out (9, rows left, up, forward) with vehicle-from-sensor. Raises AlignmentError while not ready."""
        if not self.ready:
            raise self.reason
        level, turn, braking = matrix(), matrix(), vector()
        self._improved.vertical.known(self._up)
        rotation_between(level, self._up, UP, 0)
        rotate(braking, level, self._accepted)
        braking[1] = 0.0
        normalize(braking)
        rotation_between(turn, braking, BACKWARD, 1)
        multiply(out, turn, level)
