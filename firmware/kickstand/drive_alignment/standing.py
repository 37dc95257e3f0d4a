"""The vertical from standing: the mean direction of gravity over many stops, because no city is all uphill (ViriCiti).

A stop counts once however long it was, and gives the gyro's bias too.
"""

from ..rotation import angle_deg, norm, normalize, vector

SPEED_MPS = 0.5  # a GPS at rest shows up to this
MOVED_MPS = 2.0  # between two stops
SETTLE_S = 1.0  # a vehicle rocks back after braking
COUNTS_S = 2.0
STILL_G = 0.06  # of a mean of a tenth of a second from those before: a diesel at idle, wind, passengers
STILL_DPS = 3.0
AVERAGE_S = 0.5
SAME_STOP_DEG = 1.5  # doors and passengers
TURNED_S = 6.0  # longer than a speed may be late
TURNING_DPS = 10.0  # from the bias of the last stop, more than warming does: a speed of zero in a bend is no stop
MAX_APART_DEG = 8.0  # 14 %: two stops further apart are not two slopes


class StandingVertical:
    """update() with each mean of about 0.1 s.

    stops; up: the vertical in the sensor's axes (unit vector) once stops > 0; bias: the gyro's (3, deg/s) at the last
    stop; standing: at a stop now; moved: two stops are so far apart that the mount must have moved.
    """

    def __init__(self):
        self.stops = 0
        self.up = vector()
        self.bias = [0.0] * 3
        self.standing = False
        self.moved = False
        self._sum = [0.0] * 3  # of the directions of the stops before
        self._drove()

    def _drove(self):
        """The next stop is another one."""
        self._stop = [0.0] * 3  # mean force of this stop
        self._bias = [0.0] * 3
        self._averaged_s = 0.0
        self._counted = False
        self._force = None
        self._still_s = 0.0

    def update(self, force, rate, speed_mps, seconds):
        """force (3, g), rate (3, deg/s): means of the last seconds; speed_mps: as last heard."""
        if speed_mps > MOVED_MPS and self._force is not None:
            if self._counted:
                for i in range(3):
                    self._sum[i] += self._direction[i]
            self._drove()
        self.standing = False
        if speed_mps > SPEED_MPS:
            self._still_s = 0.0
            return
        if self._force is None:
            self._force, self._rate = list(force), list(rate)
        gain = min(1.0, seconds / AVERAGE_S)
        from_force = from_rate = from_bias = 0.0
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
        if turning or from_force > STILL_G * STILL_G or from_rate > STILL_DPS * STILL_DPS:
            self._still_s = 0.0
            return
        self._still_s += seconds
        if self._still_s < SETTLE_S:
            return
        if self._counted:
            apart = angle_deg(self._force, self._stop)
            if apart > SAME_STOP_DEG:
                # off already, while a late speed still says zero; or the sensor has been turned
                self.moved = self.moved or (apart > MAX_APART_DEG and self._still_s > TURNED_S)
                return
        self.standing = True
        self._average(force, rate, seconds)

    def _average(self, force, rate, seconds):
        self._averaged_s += seconds
        gain = seconds / self._averaged_s
        for i in range(3):
            self._stop[i] += gain * (force[i] - self._stop[i])
            self._bias[i] += gain * (rate[i] - self._bias[i])
        if self._averaged_s < COUNTS_S:
            return
        if not self._counted:
            self._counted = True
            self.stops += 1
        size = norm(self._stop)
        self._direction = [component / size for component in self._stop]
        for i in range(3):
            self.bias[i] = self._bias[i]
            self.up[i] = self._sum[i] + self._direction[i]
        normalize(self.up)
        if self.stops > 1 and angle_deg(self._direction, self._sum) > MAX_APART_DEG:
            self.moved = True
