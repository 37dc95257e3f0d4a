"""The vertical from standing: the mean direction of gravity over many stops, because no city is all uphill (ViriCiti).

Each stop counts once, however long it was. At a stop the gyro reads its bias alone, which is measured too.
"""

from ..rotation import angle_deg, norm, normalize, vector

SPEED_MPS = 0.5  # a GPS at rest shows up to this
MOVED_MPS = 2.0  # what was faster in between makes two stops of one
SETTLE_S = 1.0  # a vehicle rocks back after braking
COUNTS_S = 2.0  # a stop counts after being averaged for so long
# How far a mean over 0.1 s may be from those before it at a stop: a diesel at idle, wind, passengers
STILL_G = 0.06
STILL_DPS = 3.0
AVERAGE_S = 0.5  # time constant of "those before it"
SAME_STOP_DEG = 1.5  # how far doors and passengers tilt a standing vehicle
TURNED_S = 6.0  # still for longer than a speed may be late: the sensor itself was turned
# Rotation rate less the last stop's bias, which warming up changes by less: who turns so fast does not stand, whatever
# the speed says.
TURNING_DPS = 10.0
MAX_APART_DEG = 8.0  # 14 %: what parts two stops further than this is no slope


class StandingVertical:
    """update() with each mean over about 0.1 s.

    stops: how many; up: the vertical in the sensor's axes (unit vector) once there was a stop; bias: the gyro's (3,
    deg/s) at the last stop; standing: at a stop now; moved: the mount must have moved, as two stops are so far apart.
    """

    def __init__(self, bias=(0.0, 0.0, 0.0)):
        self.stops = 0
        self.up = vector()
        self.bias = list(bias)
        self.standing = False
        self.moved = False
        self._sum = [0.0] * 3  # of the directions of the stops before this one
        self._begin_stop()

    def _begin_stop(self):
        """The vehicle has driven: what follows belongs to another stop."""
        self._stop_force = [0.0] * 3  # means of this stop
        self._stop_bias = [0.0] * 3
        self._averaged_s = 0.0
        self._counted = False
        self._force = None  # mean with the time constant AVERAGE_S
        self._still_s = 0.0

    def update(self, force, rate, speed_mps, seconds):
        """force (3, g), rate (3, deg/s): means over the last seconds; speed_mps: the last value of the source."""
        if speed_mps > MOVED_MPS and self._force is not None:
            if self._counted:
                for i in range(3):
                    self._sum[i] += self._direction[i]
            self._begin_stop()
        self.standing = False
        if speed_mps > SPEED_MPS:
            self._still_s = 0.0
            return
        if not self._is_still(force, rate, seconds):
            self._still_s = 0.0
            return
        self._still_s += seconds
        if self._still_s < SETTLE_S:
            return
        if self._counted:
            apart_deg = angle_deg(self._force, self._stop_force)
            if apart_deg > SAME_STOP_DEG:
                # Either the vehicle drives again while a late speed still says zero, or the sensor has been turned.
                self.moved = self.moved or (apart_deg > MAX_APART_DEG and self._still_s > TURNED_S)
                return
        self.standing = True
        self._average(force, rate, seconds)

    def _is_still(self, force, rate, seconds):
        """True if force and rate are near their running means, and rate near the bias of the last stop."""
        if self._force is None:
            self._force, self._rate = list(force), list(rate)
        gain = min(1.0, seconds / AVERAGE_S)
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
        return not (turning or from_force > STILL_G * STILL_G or from_rate > STILL_DPS * STILL_DPS)

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
        for i in range(3):
            self.bias[i] = self._stop_bias[i]
            self.up[i] = self._sum[i] + self._direction[i]
        normalize(self.up)
        if self.stops > 1 and angle_deg(self._direction, self._sum) > MAX_APART_DEG:
            self.moved = True
