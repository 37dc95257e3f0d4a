"""Alignment by driving as ViriCiti published it: R = R2 R1, each a rotation by Rodrigues' formula.

R1 turns the mean direction of gravity at the stops upwards. R2 turns the mean force of the brakings, levelled by R1,
backwards; a braking counts if the directions of its levelled force spread little. A tilt left by the stops leaks into
forward, some 3 to 4 degrees, which more brakings do not take away: driving.py does. This is here to compare with.
"""

from math import degrees, sqrt

from kickstand.drive_alignment.alignment import DRIVE, GAP_US, READY, DriveAlignment
from kickstand.drive_alignment.events import MAX_INTERVAL_US, MIN_INTERVAL_US
from kickstand.drive_alignment.reasons import not_ready
from kickstand.rotation import matrix, normalize, rotate, vector

from .dispersion import CircularDispersion
from .rodrigues import multiply, rotation_between

MAX_DISPERSION = 0.02  # 8 degrees
MIN_LEVEL_G = 0.03  # smaller forces point anywhere
BRAKING_MPS2 = -1.0
MEAN_US = 100_000
LOSS_MPS = 1.5  # a shorter one is noise
NEEDED = 3
UP = (0.0, 1.0, 0.0)
BACKWARD = (0.0, 0.0, -1.0)


class _Samples:
    """Means of a tenth of a second: their sum (3, g) and the directions of their levelled force."""

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
    """Used like a DriveAlignment, which runs beside it: speed and mount are checked by that one.

    counted, turned: brakings accepted, and refused for their dispersion. quality_deg: standard error of the mean
    direction of those accepted, which says nothing of the leak.
    """

    def __init__(self, vehicle, up=None, bias=None):
        self._checked = DriveAlignment(vehicle, up, bias)
        self.vehicle = vehicle
        self.standing = self._checked.standing
        self.needed = NEEDED
        self.counted = self.turned = 0
        self._accepted = [0.0] * 3  # sum of their forces
        self._braking = _Samples()  # the one that goes on
        self._interval = _Samples()  # since the last speed: nobody knows yet what it was
        self._means = CircularDispersion()  # of the accepted brakings, each one direction
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
        """What is wrong with speed or mount: an AlignmentError, or None."""
        return self._checked.problem

    @property
    def state(self):
        """As a DriveAlignment's."""
        if self.ready:
            return READY
        state = self._checked.state
        return DRIVE if state == READY else state

    @property
    def ready(self):
        """True once matrix() can be taken."""
        return self.problem is None and self.counted >= self.needed

    @property
    def quality_deg(self):
        """See above; 180 until there are two brakings."""
        n = self.counted
        return degrees(sqrt(self._means.value() / n)) if n > 1 else 180.0

    @property
    def reason(self):
        """Why matrix() cannot be had yet: an AlignmentError."""
        return self.problem or not_ready(self._checked, self.counted, self.needed, self.turned)

    def update(self, force, rate, dt_us):
        """As DriveAlignment.update()."""
        self._checked.update(force, rate, dt_us)
        if dt_us > GAP_US:
            self._forget()
            return
        for i in range(3):
            self._sums[i] += force[i] * dt_us
        self._sums_us += dt_us
        self._interval_us = min(self._interval_us + dt_us, MAX_INTERVAL_US + 1)
        if self._sums_us >= MEAN_US:
            for i in range(3):
                self._levelled[i] = self._sums[i] / self._sums_us
                self._sums[i] = 0.0
            self._sums_us = 0
            if self._checked.vertical(self._up):
                self._sample(list(self._levelled))

    def finish(self):
        """As DriveAlignment.finish()."""
        self._checked.finish()

    def _forget(self):
        self._braking.clear()
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
        """As DriveAlignment.measure_speed(); the published method does not look for a lag."""
        self._checked.measure_speed(speed_mps, age_us)
        seconds = self._interval_us * 1e-6
        if self._interval_us < MIN_INTERVAL_US:
            return
        if self._speed < 0.0 or self._interval_us > MAX_INTERVAL_US:
            self._braking.clear()
        elif (speed_mps - self._speed) / seconds < BRAKING_MPS2:
            self._braking.join(self._interval)
            self._loss += self._speed - speed_mps
        elif self._braking.directions.count:
            self._end_braking()
        self._interval.clear()
        self._interval_us = 0
        self._speed = speed_mps

    def _end_braking(self):
        loss, self._loss = self._loss, 0.0
        if loss >= LOSS_MPS and self._braking.directions.value() <= MAX_DISPERSION:
            self.counted += 1
            mean = self._levelled
            for i in range(3):
                self._accepted[i] += self._braking.force[i]
            rotate(mean, self._level, self._braking.force)
            self._means.add(mean[0], mean[2], sqrt(mean[0] * mean[0] + mean[2] * mean[2]))
        elif loss >= LOSS_MPS:
            self.turned += 1
        self._braking.clear()

    def matrix(self, out):
        """Fill out (9, rows left, up, forward) with vehicle-from-sensor. Raises AlignmentError while not ready."""
        if not self.ready:
            raise self.reason
        level, turn, braking = matrix(), matrix(), vector()
        self._checked.vertical(self._up)
        rotation_between(level, self._up, UP, 0)
        rotate(braking, level, self._accepted)
        braking[1] = 0.0
        normalize(braking)
        rotation_between(turn, braking, BACKWARD, 1)
        multiply(out, turn, level)
