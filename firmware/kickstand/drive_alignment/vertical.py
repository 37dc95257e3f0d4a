"""The vertical in the sensor's axes, from the best source that a drive has so far.

A motorcycle has it from the upright pose, or else from riding straight, where balance keeps the lateral force at zero.
A car has it from its stops and from driving straight, in equal shares: the road's camber and slope tilt both alike.
"""

from ..errors import AlignmentError
from ..rotation import angle_deg, norm, normalize, vector

MEAN_S = 60.0  # time constant of the mean force, which serves as the vertical until there is a better one
MAX_CHANGE_DEG = 8.0  # between two verticals of one mount; mean slopes of roads differ by less


class Vertical:
    """is_car: stops show the vertical. from_pose: unit vector of the upright pose (a motorcycle's), or None.
    standing: the StandingVertical of the same drive.
    """

    def __init__(self, is_car, from_pose, standing):
        self.is_car = is_car
        self._from_pose = vector(from_pose[0], from_pose[1], from_pose[2]) if from_pose is not None else None
        self._standing = standing
        self._mean = None  # force (3, g)
        self._mean_s = 0.0

    def update(self, force, seconds):
        """force (3, g): the mean over the last seconds."""
        self._mean = self._mean or vector()
        self._mean_s = min(MEAN_S, self._mean_s + seconds)
        gain = seconds / self._mean_s
        for i in range(3):
            self._mean[i] += gain * (force[i] - self._mean[i])

    @property
    def turn_axis(self):
        """The axis of the yaw rate (3, length about 1), known from the first update() on."""
        return self._standing.up if self.is_car and self._standing.stops else self._from_pose or self._mean

    def known(self, out, fit=None):
        """Fill out (unit vector) with the vertical. False if it is not known yet, as a car's before its first stop.

        fit: the Fit of all straight driving, None if there is none yet.
        """
        if self._from_pose is not None:
            best = self._from_pose
        elif self.is_car and not self._standing.stops:
            return False
        elif fit is None:
            best = self._standing.up if self.is_car else self._mean
        elif self.is_car:
            best = [self._standing.up[i] + fit.level[i] / norm(fit.level) for i in range(3)]
        else:
            best = fit.level
        if best is None:
            return False
        for i in range(3):
            out[i] = best[i]
        normalize(out)
        return True

    def problem(self, level):
        """An AlignmentError if straight driving's vertical is far from that of the stops or of the upright pose, else
        None. level (3): of the Fit of all straight driving."""
        before = self._standing.up if self.is_car else self._from_pose
        change_deg = 0.0 if before is None else angle_deg(before, level)
        if change_deg > MAX_CHANGE_DEG:
            return AlignmentError("mount-moved", "since-standing" if self.is_car else "since-upright-pose", change_deg)
        return None
