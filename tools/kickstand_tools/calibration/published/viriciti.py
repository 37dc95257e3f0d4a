"""Alignment by driving as ViriCiti published it: R = R2 R1, each a rotation by Rodrigues' formula.

R1 rotates the mean direction of gravity at the stops to up. R2 rotates the mean force of the braking events, levelled
by R1, to backward. A braking event counts if the directions of its levelled force spread little. A remaining tilt of
the vertical by the stops makes a yaw error of some 3 to 4 degrees, which more braking events do not reduce. The
firmware's DriveAlignment does not have this error; the published method is here for comparison.
"""

from math import degrees, sqrt

from kickstand.drive_alignment.alignment import READY, WAITING_FOR_BRAKING, DriveAlignment
from kickstand.drive_alignment.events import MAX_INTERVAL_US, MIN_INTERVAL_US
from kickstand.rotation import matrix, normalize, rotate, vector
from kickstand.units import GAP_US

from .dispersion import CircularDispersion
from .rodrigues import multiply, rotation_between

MAX_DISPERSION = 0.02  # largest dispersion of a braking event's directions that counts: 8 degrees
MIN_LEVEL_G = 0.03  # the direction of a smaller levelled force is noise
BRAKING_MPS2 = -1.0  # an interval with more deceleration belongs to a braking event
MEAN_US = 100_000
LOSS_MPS = 1.5  # a braking event that reduces the speed by less is noise
MIN_EVENTS = 3
UP = (0.0, 1.0, 0.0)
BACKWARD = (0.0, 0.0, -1.0)


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
        self.vehicle = vehicle
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
    def state(self):
        """One of the states of DriveAlignment."""
        if self.ready:
            return READY
        state = self._improved.state
        return WAITING_FOR_BRAKING if state == READY else state

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
