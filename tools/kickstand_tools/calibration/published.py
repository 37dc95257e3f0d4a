"""Alignment by driving with ViriCiti's published method, for comparison with the firmware's DriveAlignment.

The alignment is R = R2 R1, two rotations by Rodrigues' formula. R1 rotates the mean direction of gravity at the stops
to up. R2 rotates the mean force of the braking events, levelled by R1, to backward. A braking event counts if the
directions of its levelled force spread little.

The vertical from the stops is slightly tilted. This tilt causes a yaw error of about 3 to 4 degrees, and more braking
events do not reduce it. The firmware's DriveAlignment does not have this error.
"""

from array import array
from collections.abc import Sequence

import numpy as np
from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand.drive_alignment.events import MAX_INTERVAL_US, MIN_INTERVAL_US
from kickstand.errors import Refusal
from kickstand.rotation import vector
from kickstand.units import GAP_US

from ..signals import Array, cross_matrix

MAX_DISPERSION = 0.02  # largest circular dispersion of a braking event: a spread of 8 degrees
MIN_LEVEL_G = 0.03  # a smaller levelled force has a random direction, so it is not used
BRAKING_MPS2 = -1.0  # an interval with more deceleration than this belongs to a braking event
MEAN_US = 100_000  # forces are averaged over this time
LOSS_MPS = 1.5  # least reduction of the speed in a braking event; a smaller reduction is noise
MIN_EVENTS = 3
UP = np.array([0.0, 1.0, 0.0])
BACKWARD = np.array([0.0, 0.0, -1.0])
NO_MEAN = 9.9  # largest circular dispersion; also the value for opposite directions, which have no mean direction


def rotation_between(a: Array, b: Array, axis: int) -> Array:
    """Return the rotation that takes unit vector a to unit vector b, shape (3, 3) (O. Rodrigues).

        R = I + K + K^2 / (1 + c),  K the cross product matrix of a x b, c = a . b

    Near c = -1 the quotient has no significant digits left. Therefore, if c < 0, a half turn D about a coordinate axis
    is applied first: R = Rodrigues(D a, b) D. The half turn makes c > 0.

    axis: coordinate axis of the half turn, 0, 1 or 2. The axis must be perpendicular to b.
    """
    half_turn = np.eye(3)
    if a @ b < 0.0:
        half_turn = -half_turn
        half_turn[axis, axis] = 1.0
    near = half_turn @ a
    cross = cross_matrix(np.cross(near, b))
    return (np.eye(3) + cross + cross @ cross / (1.0 + near @ b)) @ half_turn


def circular_dispersion(directions: Sequence[complex]) -> float:
    """Return the circular dispersion of directions in a plane, at most NO_MEAN (N. I. Fisher, 1993, section 2.3).

        d = (1 - rho2) / (2 R^2),  R = |mean of e^(i a)|,  rho2 = the mean cosine of 2 (a - mean direction)

    For small spreads, d is about the variance in rad^2: 0.02 means 8 degrees, 0.005 means 4 degrees.

    directions: complex numbers of length 1.
    """
    mean = np.mean(directions)
    square = float(abs(mean)) ** 2
    if square <= 1e-6:
        return NO_MEAN
    rho2 = float(np.mean((np.array(directions) * mean.conjugate()) ** 2).real) / square
    return min(NO_MEAN, max(0.0, (1.0 - rho2) / (2.0 * square)))


class PublishedAlignment:
    """The published method, with the interface of DriveAlignment.

    It uses a DriveAlignment to check speed and mount, and to find the vertical.

    counted: number of accepted braking events.
    turned: number of braking events that were refused for their dispersion.
    needed: number of accepted braking events that are needed.
    """

    def __init__(self, vehicle: str, up: list[float] | None = None, bias: list[float] | None = None) -> None:
        self._improved = DriveAlignment(vehicle, up, bias)
        self.standing = self._improved.standing
        self.needed = MIN_EVENTS
        self.counted = self.turned = 0
        self._accepted = np.zeros(3)  # sum of the forces of accepted braking events
        self._means: list[complex] = []  # one direction for each accepted braking event
        # Mean forces over MEAN_US, in g along the sensor's axes, each with its levelled direction. The first list
        # belongs to the current braking event. The second list holds the means since the last speed. The next speed
        # shows if the vehicle was braking during these means.
        self._event: list[tuple[Array, complex]] = []
        self._interval: list[tuple[Array, complex]] = []
        self._level = np.eye(3)
        self._drop_event()

    @property
    def problem(self) -> Refusal | None:
        """A Refusal that names the fault of the speed or of the mount; None without a fault."""
        return self._improved.problem

    @property
    def ready(self) -> bool:
        """True once matrix() gives an alignment."""
        return self.problem is None and self.counted >= self.needed

    @property
    def quality_deg(self) -> float:
        """Standard error of the mean direction of the accepted braking events; 180 for fewer than two events.

        The standard error does not include the error of a wrong vertical.
        """
        n = self.counted
        return float(np.degrees(np.sqrt(circular_dispersion(self._means) / n))) if n > 1 else 180.0

    @property
    def reason(self) -> Refusal:
        """A Refusal that says why matrix() gives no alignment yet."""
        return self.problem or self._improved.missing(self.counted, self.needed, self.turned)

    def update(self, force: Sequence[float], rate: Sequence[float], dt_us: int) -> None:
        """Add a sample: see DriveAlignment.update()."""
        if dt_us > GAP_US:
            self.interrupt()
            return
        self._improved.update(force, rate, dt_us)
        self._sums = [total + value * dt_us for total, value in zip(self._sums, force)]
        self._sums_us += dt_us
        self._interval_us = min(self._interval_us + dt_us, MAX_INTERVAL_US + 1)
        if self._sums_us >= MEAN_US:
            mean = np.array(self._sums) / self._sums_us
            self._sums, self._sums_us = [0.0] * 3, 0
            if self._find_level():
                levelled = self._levelled(mean)
                if abs(levelled) > MIN_LEVEL_G:
                    self._interval.append((mean, levelled / abs(levelled)))

    def interrupt(self) -> None:
        """Drop the current braking event, because samples are missing. Keep the accepted events."""
        self._improved.interrupt()
        self._drop_event()

    def finish(self) -> None:
        """Do all pending work at once: see DriveAlignment.finish()."""
        self._improved.finish()

    def measure_speed(self, speed_mps: float, age_us: int = 0) -> None:
        """Add a new speed: see DriveAlignment.measure_speed(). This class does not estimate the lag."""
        self._improved.measure_speed(speed_mps, age_us)
        seconds = self._interval_us * 1e-6
        if self._interval_us < MIN_INTERVAL_US:
            return
        if self._speed < 0.0 or self._interval_us > MAX_INTERVAL_US:
            self._event, self._loss = [], 0.0
        elif (speed_mps - self._speed) / seconds < BRAKING_MPS2:
            self._event += self._interval
            self._loss += self._speed - speed_mps
        elif self._event:
            self._end_event()
        self._interval = []
        self._interval_us = 0
        self._speed = speed_mps

    def matrix(self, out: array) -> None:
        """Write the rotation from sensor to vehicle axes into `out`: 9 numbers, with the rows left, up, forward.

        Raises Refusal while the alignment is not ready.
        """
        if not self.ready:
            raise self.reason
        self._find_level()
        braking = self._level @ self._accepted * [1.0, 0.0, 1.0]
        turn = rotation_between(braking / np.linalg.norm(braking), BACKWARD, 1)
        out[:] = array("f", (turn @ self._level).ravel())

    def _drop_event(self) -> None:
        self._event, self._interval = [], []
        self._speed, self._loss, self._interval_us = -1.0, 0.0, 0
        self._sums, self._sums_us = [0.0] * 3, 0

    def _find_level(self) -> bool:
        """Set the rotation that levels forces, from the current vertical. Returns False if the vertical is unknown."""
        up = vector()
        is_known = self._improved.vertical.known(up)
        if is_known:
            self._level = rotation_between(np.array(up, dtype=float), UP, 0)
        return is_known

    def _levelled(self, force: Array) -> complex:
        """Return the horizontal part of a force as a complex number: real part to the left, imaginary part forward."""
        left, _, forward = self._level @ force
        return complex(left, forward)

    def _end_event(self) -> None:
        forces, directions = zip(*self._event)
        if self._loss >= LOSS_MPS and circular_dispersion(directions) <= MAX_DISPERSION:
            self.counted += 1
            force = np.sum(forces, axis=0)
            self._accepted += force
            mean = self._levelled(force)
            self._means.append(mean / abs(mean))
        elif self._loss >= LOSS_MPS:
            self.turned += 1
        self._event, self._loss = [], 0.0
