"""Finds the vertical in the sensor's axes. StandingVertical uses stops, and Vertical uses the best source so far.

The vertical from standing is the mean direction of gravity over many stops. The slopes of many stops average out
(ViriCiti). Each stop counts once, independent of its duration. At a stop the gyro reads only its bias, which is
measured too.

At a stop a motorcycle may lean to a side. So its vertical comes from the upright pose or, without this pose, from
riding straight, because a balanced bike has no lateral force. A car's vertical is the mean of two verticals,
from its stops and from driving straight. The camber and slope of the road disturb both verticals by about the same
amount.
"""

from ..errors import Refusal
from ..rotation import angle_deg, norm, normalize, vector
from ..units import const

_STANDING_MPS = const(0.5)  # highest speed that counts as standing, because a GPS at rest shows speeds up to 0.5 m/s
MOVED_MPS = 2.0  # speed that a vehicle must exceed between two stops
SETTLE_S = 1.0  # time for which a vehicle rocks after braking
COUNTS_S = 2.0  # time that a stop must last after SETTLE_S to count
# Largest difference at a stop between a mean over 0.1 s and a mean with the time constant _AVERAGE_S. An idling diesel,
# wind and passengers cause a smaller difference.
_STILL_G = const(0.06)
_STILL_DPS = const(3.0)
_AVERAGE_S = const(0.5)
_SAME_STOP_DEG = const(1.5)  # largest angle by which doors and passengers tilt a standing vehicle
# Longest time for which the angle of a sensor that was not rotated can differ from its angle at the last stop. The
# angle also differs for a short time when the vehicle drives again but the late speed is still zero.
_TURNED_S = const(6.0)
# Largest difference between a rate at a stop and the bias at the last stop. At a larger difference the vehicle drives
# in a bend, and a speed of zero is wrong. The bias of a gyro that warms up changes by less than this limit.
TURNING_DPS = 10.0
_MEAN_S = const(60.0)  # time constant of the mean force, which is used until a better vertical is known
# Largest difference of two verticals that the road's slope can cause (14 %). If two verticals differ more, the mount
# moved.
MAX_CHANGE_DEG = 8.0


class StandingVertical:
    """Measures the vertical at stops. Call update() with each mean over about 0.1 s.

    Args:
        bias: the gyro's bias until the first stop, 3 values in deg/s.

    Attributes:
        stops: number of stops that count.
        up: the vertical, a unit vector in the sensor's axes; None before the first stop.
        bias: the gyro's bias at the last stop, 3 values in deg/s.
        standing: True during a stop.
        moved: True if the verticals of two stops differ so much that the mount must have moved.
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
        self._stop_force = [0.0] * 3  # mean force during the current stop
        self._stop_bias = [0.0] * 3
        self._averaged_s = 0.0
        self._counted = False
        self._force = None  # running mean of the force with the time constant _AVERAGE_S
        self._still_s = 0.0

    def update(self, force, rate, speed_mps, seconds):
        """Take the means over the last `seconds`.

        Args:
            force: mean force, 3 values in g.
            rate: mean rate, 3 values in deg/s.
            speed_mps: the last value of the speed source.
            seconds: duration of the means.
        """
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
        """Return True if force and rate are near their running means, and the rate is near the bias of the last
        stop."""
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
        self._direction = list(self._stop_force)
        normalize(self._direction)
        self.bias[:] = self._stop_bias
        self.up = [self._sum[i] + self._direction[i] for i in range(3)]
        normalize(self.up)
        if self.stops > 1 and angle_deg(self._direction, self._sum) > MAX_CHANGE_DEG:
            self.moved = True


class Vertical:
    """The best vertical so far.

    Args:
        is_car: True for a car, whose stops are used.
        from_pose: for a motorcycle, the vertical of the upright pose, a unit vector, or None.
        standing: the StandingVertical of the same drive.
    """

    def __init__(self, is_car, from_pose, standing):
        self.is_car = is_car
        self._from_pose = vector(from_pose[0], from_pose[1], from_pose[2]) if from_pose is not None else None
        self._standing = standing
        self._mean = None  # mean force (3, g) with the time constant _MEAN_S
        self._mean_s = 0.0

    def update(self, force, seconds):
        """Take the mean force over the last `seconds`, 3 values in g."""
        self._mean = self._mean or vector()
        self._mean_s = min(_MEAN_S, self._mean_s + seconds)
        gain = seconds / self._mean_s
        for i in range(3):
            self._mean[i] += gain * (force[i] - self._mean[i])

    @property
    def turn_axis(self):
        """The axis of the yaw rate, 3 values with a length of about 1. The axis is known after the first update()."""
        return (self.is_car and self._standing.up) or self._from_pose or self._mean

    def known(self, out, fit=None):
        """Write the vertical into out, as a unit vector. Return False if the vertical is not known yet.

        In a car the vertical is unknown until the first stop.

        Args:
            out: array of 3.
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
        """Return a Refusal if the vertical of straight driving is wrong for the stops or the upright pose, else
        None.

        Args:
            level: the vertical of all straight driving, from its Fit, 3 values.
        """
        standing_up = self._standing.up if self.is_car else self._from_pose
        change_deg = 0.0 if standing_up is None else angle_deg(standing_up, level)
        if change_deg > MAX_CHANGE_DEG:
            return Refusal("mount-moved", "since-standing" if self.is_car else "since-upright", change_deg)
        return None
