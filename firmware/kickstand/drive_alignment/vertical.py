"""Finds the vertical in the sensor's axes: StandingVertical from stops, Vertical from the best source so far.

The vertical from standing is the mean direction of gravity over many stops, because no city is all uphill (ViriCiti).
Each stop counts once, however long it was. At a stop the gyro reads only its bias, which is measured too.

A motorcycle's stops are not level sideways. Its vertical comes from the upright pose, or else from riding straight: a
balanced bike has no lateral force. A car's vertical comes in equal shares from its stops and from driving straight,
because the road's camber and slope tilt both in the same way.
"""

from ..errors import AlignmentError
from ..rotation import angle_deg, norm, normalize, vector
from ..units import const

_STANDING_MPS = const(0.5)  # a lower speed counts as standing, because a GPS at rest shows up to this speed
MOVED_MPS = 2.0  # after a higher speed the next stop is a new one
SETTLE_S = 1.0  # for this time a vehicle rocks after braking
COUNTS_S = 2.0  # after settling, a stop must last this long to count
# Largest difference at a stop between a mean over 0.1 s and a mean with the time constant _AVERAGE_S. An idling diesel,
# wind and passengers cause less.
_STILL_G = const(0.06)
_STILL_DPS = const(3.0)
_AVERAGE_S = const(0.5)
_SAME_STOP_DEG = const(1.5)  # doors and passengers tilt a standing vehicle by less
# a sensor that is still at another angle for longer was rotated, because a late speed of zero would have ended earlier
_TURNED_S = const(6.0)
# A rate that differs by more from the bias at the last stop means a bend, so a speed of zero is wrong. Warming up
# changes the bias by less.
TURNING_DPS = 10.0
_MEAN_S = const(60.0)  # time constant of the mean force, which serves as the vertical until a better one is known
# largest difference of two verticals due to the road's slope (14 %); a larger one means that the mount moved
MAX_CHANGE_DEG = 8.0


class StandingVertical:
    """Measures the vertical at stops. Call update() with each mean over about 0.1 s.

    stops: number of stops; up: the vertical in the sensor's axes (unit vector), None before the first stop; bias: the
    gyro's bias (3, deg/s) at the last stop; standing: True during a stop; moved: True if the verticals of two stops
    differ so much that the mount must have moved.
    """

    def __init__(self, bias=(0.0, 0.0, 0.0)):
        self.stops = 0
        self.up = None
        self.bias = list(bias)
        self.standing = False
        self.moved = False
        self._sum = [0.0] * 3  # sum of the directions of the earlier stops
        self._begin_stop()

    def _begin_stop(self):
        """Begin the means of a new stop, because the vehicle has driven."""
        self._stop_force = [0.0] * 3  # means of this stop
        self._stop_bias = [0.0] * 3
        self._averaged_s = 0.0
        self._counted = False
        self._force = None  # mean with the time constant _AVERAGE_S
        self._still_s = 0.0

    def update(self, force, rate, speed_mps, seconds):
        """Take force (3, g) and rate (3, deg/s): means over the last `seconds`; speed_mps: the source's last value."""
        if speed_mps > MOVED_MPS and self._force is not None:
            if self._counted:
                for i in range(3):
                    self._sum[i] += self._direction[i]
            self._begin_stop()
        self.standing = False
        if speed_mps > _STANDING_MPS or not self._is_still(force, rate, seconds):
            self._still_s = 0.0
            return
        self._still_s += seconds
        if self._still_s < SETTLE_S:
            return
        if self._counted:
            apart_deg = angle_deg(self._force, self._stop_force)
            if apart_deg > _SAME_STOP_DEG:
                # Either the vehicle drives again while a late speed is still zero, or the sensor was rotated.
                self.moved = self.moved or (apart_deg > MAX_CHANGE_DEG and self._still_s > _TURNED_S)
                return
        self.standing = True
        self._average(force, rate, seconds)

    def _is_still(self, force, rate, seconds):
        """True if force and rate are near their running means, and rate near the bias of the last stop."""
        if self._force is None:
            self._force, self._rate = list(force), list(rate)
        gain = min(1.0, seconds / _AVERAGE_S)
        from_force = from_rate = from_bias = 0.0  # squared differences
        for i in range(3):
            d = force[i] - self._force[i]
            self._force[i] += gain * d
            from_force += d * d
            d = rate[i] - self._rate[i]
            self._rate[i] += gain * d
            from_rate += d * d
            d = rate[i] - self.bias[i]
            from_bias += d * d
        turning = self.stops and from_bias > TURNING_DPS * TURNING_DPS
        return not (turning or from_force > _STILL_G * _STILL_G or from_rate > _STILL_DPS * _STILL_DPS)

    def _average(self, force, rate, seconds):
        self._averaged_s += seconds
        gain = seconds / self._averaged_s
        for i in range(3):
            self._stop_force[i] += gain * (force[i] - self._stop_force[i])
            self._stop_bias[i] += gain * (rate[i] - self._stop_bias[i])
        if self._averaged_s < COUNTS_S:
            return
        if not self._counted:
            self._counted = True
            self.stops += 1
        size = norm(self._stop_force)
        self._direction = [component / size for component in self._stop_force]
        self.bias[:] = self._stop_bias
        self.up = [self._sum[i] + self._direction[i] for i in range(3)]
        normalize(self.up)
        if self.stops > 1 and angle_deg(self._direction, self._sum) > MAX_CHANGE_DEG:
            self.moved = True


class Vertical:
    """The best vertical so far. is_car: True to use stops. from_pose: unit vector of the upright pose (a motorcycle's),
    or None. standing: the StandingVertical of the same drive.
    """

    def __init__(self, is_car, from_pose, standing):
        self.is_car = is_car
        self._from_pose = vector(from_pose[0], from_pose[1], from_pose[2]) if from_pose is not None else None
        self._standing = standing
        self._mean = None  # mean force (3, g) with the time constant _MEAN_S
        self._mean_s = 0.0

    def update(self, force, seconds):
        """Take force (3, g): the mean over the last `seconds`."""
        self._mean = self._mean or vector()
        self._mean_s = min(_MEAN_S, self._mean_s + seconds)
        gain = seconds / self._mean_s
        for i in range(3):
            self._mean[i] += gain * (force[i] - self._mean[i])

    @property
    def turn_axis(self):
        """The axis of the yaw rate (3, length about 1), known from the first update() on."""
        return (self.is_car and self._standing.up) or self._from_pose or self._mean

    def known(self, out, fit=None):
        """Write the vertical into out (a unit vector). Return False if it is not known yet. In a car it is
        unknown until the first stop.

        fit: the Fit of all straight driving, or None.
        """
        if self.is_car:
            best = self._standing.up
            if best and fit:
                best = [best[i] + fit.level[i] / norm(fit.level) for i in range(3)]
        else:
            best = self._from_pose or (fit.level if fit else self._mean)
        if not best:
            return False
        for i in range(3):
            out[i] = best[i]
        normalize(out)
        return True

    def problem(self, level):
        """Return an AlignmentError if the vertical of straight driving is far from that of the stops or the upright
        pose, else None. level (3): the vertical of straight driving, from the Fit of all of it."""
        before = self._standing.up if self.is_car else self._from_pose
        change_deg = 0.0 if before is None else angle_deg(before, level)
        if change_deg > MAX_CHANGE_DEG:
            return AlignmentError("mount-moved", "since-standing" if self.is_car else "since-upright", change_deg)
        return None
