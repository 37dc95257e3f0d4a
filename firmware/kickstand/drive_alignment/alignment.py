"""Sensor to vehicle from driving: vertical from standing and straight driving, forward from braking (ViriCiti).

The published method (driving_published.py) put right: forward is regressed on the change of speed, with what is not
braking taken up by an intercept; turns are left out; the lag of the speed is found; it says how good it is.

    drive = DriveAlignment("car")                  # or ("motorcycle", up): the two presses gave the vertical
    drive.update(force, rate, dt_us)               # some 100 times a second, sensor's axes
    drive.measure_speed(speed_mps, age_us)         # each new value of the speed source, 1 to 10 a second
    if drive.ready: drive.matrix(out)

What to show follows from `state`, `counted` of `needed` and, when REFUSED, from `problem`. Whether an alignment
that is there already still fits: driving_check.compare(). Fixed memory; each call does a short piece of the work.
"""

from ..errors import AlignmentError
from ..rotation import cross, norm, normalize, vector
from .events import DrivingEvents
from .history import BIN_US, ForceHistory
from .quality import LEVEL_DEG, MAX_STARTS, NEEDED, DrivingQuality
from .reasons import not_ready
from .speed_check import SpeedCheck
from .standing import StandingVertical

CAR, MOTORCYCLE = "car", "motorcycle"

# state
WAITING_FOR_SPEED = 0  # none has come yet, or none for STALE_US
WAITING_FOR_STOP = 1  # a car only: the vertical and the gyro's bias come from standing
DRIVE = 2  # waits for a braking in a straight line
BRAKING = 3  # one is going on
TURNING = 4  # one is going on in a turn: not counted
READY = 5  # matrix() can be taken; it gets better with more brakings
REFUSED = 6  # matrix() cannot be had, problem says why

GAP_US = 500_000  # samples are missing
STALE_US = 5_000_000
PIECE_US = 12_000  # where samples come slower, more pieces of work are done at each
MEAN_S = 60.0  # of the force, which is the vertical until there is a better one


class DriveAlignment:
    """vehicle: CAR or MOTORCYCLE. up: unit vector of the vertical in the sensor's axes, from the two poses, if known
    (motorcycle; without it the vertical comes from straight riding). bias: of the gyro (3, deg/s), to be taken off
    until a stop shows it; zeros for rates that are corrected already. Without it nothing counts before the first stop.

    standing: a StandingVertical, with the gyro's bias; events: DrivingEvents; quality: a DrivingQuality; needed: of
    counted.
    """

    def __init__(self, vehicle, up=None, bias=None):
        self.vehicle = vehicle
        self.standing = StandingVertical()
        self._bias_known = bias is not None
        for i in range(3):
            self.standing.bias[i] = bias[i] if bias else 0.0
        self.needed = NEEDED
        self.top_mps = 0.0
        self._history = ForceHistory()
        self.events = DrivingEvents(self._history)
        self.quality = DrivingQuality()
        self._up = vector(up[0], up[1], up[2]) if up is not None else None
        self._mean = None
        self._mean_s = 0.0
        self._judged = (0, 0)  # events and stops
        self._speed_check = SpeedCheck()
        self._sums = [0.0] * 6
        self._sums_us = 0
        self._speed = -1.0  # none yet
        self._quiet_us = 0  # since the last value
        self._bin = None  # means of the last one
        self._work = None

    @property
    def counted(self):
        """How much of what is needed is there: each straight braking, and up to two straight starts."""
        return self.events.brakings + min(self.events.starts, MAX_STARTS)

    @property
    def turned(self):
        """Brakings not counted because of a turn."""
        return self.events.turned

    @property
    def quality_deg(self):
        """Standard error of forward's direction, 180 until there is one."""
        return self.quality.quality_deg

    @property
    def heard(self):
        """True once there was a speed."""
        return self._speed >= 0.0

    @property
    def state(self):
        """One of the constants above."""
        if self.problem is not None:
            return REFUSED
        if self.ready:
            return READY
        if self._speed < 0.0 or self._quiet_us > STALE_US:
            return WAITING_FOR_SPEED
        if self.vehicle == CAR and not self.standing.stops:
            return WAITING_FOR_STOP
        if not self.events.braking:
            return DRIVE
        return BRAKING if self.events.straight else TURNING

    @property
    def ready(self):
        """True while matrix() can be taken."""
        return self.quality.good and self.problem is None

    @property
    def problem(self):
        """What is wrong with speed or mount: an AlignmentError, or None."""
        if self._speed_check.problem is None and self.standing.moved and self.vehicle == CAR:
            return AlignmentError("mount-moved", "between-stops", LEVEL_DEG)
        if self.counted < self.needed:
            return self._speed_check.problem
        return self._speed_check.problem or self.quality.mount_problem or self.quality.speed_problem

    @property
    def reason(self):
        """Why matrix() cannot be had yet: an AlignmentError."""
        return self.problem or not_ready(self, self.counted, self.needed, self.turned)

    def update(self, force, rate, dt_us):
        """force (3, g), rate (3, deg/s): calibrated, sensor's axes; dt_us: integer microseconds since the one
        before."""
        if dt_us > GAP_US:
            self._interrupt()
            return
        sums = self._sums
        sums[0] += force[0] * dt_us
        sums[1] += force[1] * dt_us
        sums[2] += force[2] * dt_us
        sums[3] += rate[0] * dt_us
        sums[4] += rate[1] * dt_us
        sums[5] += rate[2] * dt_us
        self._sums_us += dt_us
        if self._sums_us >= BIN_US:
            self._end_bin()
            return
        for _ in range(1 + dt_us // PIECE_US):
            self._piece()

    def _piece(self):
        if self._bin is not None:
            force, rate, seconds = self._bin
            self._bin = None
            if self._speed >= 0.0:
                self.standing.update(force, rate, self._speed, seconds)
        elif self._work is not None:
            if next(self._work, True):
                self._work = None
        elif self.events.due:
            self._work = self._follow()

    def finish(self):
        """No more samples will come: do at once what work is left."""
        while self._bin is not None or self._work is not None:
            self._piece()

    def measure_speed(self, speed_mps, age_us=0):
        """A new value of the speed source. age_us: how old it is known to be; an unknown lag is found by itself."""
        self._speed_check.measure(speed_mps)
        if not speed_mps >= 0.0:
            speed_mps = 0.0
        self._speed = speed_mps
        if self._quiet_us > STALE_US:  # and the history's time may have wrapped round since
            self.events.interrupt()
        self._quiet_us = 0
        self.top_mps = max(self.top_mps, speed_mps)
        self.events.measure_speed(speed_mps, self._history.now + self._sums_us - age_us)

    def known_vertical(self):
        """The vertical that does not come from driving, None if there is none, and since when a
        mount has moved that no longer fits it."""
        if self.vehicle == CAR:
            return self.standing.up, "since-standing"
        return self._up, "since-upright-pose"

    def vertical(self, out, fit=None):
        """Fill out (3) with the vertical as well as it is known. False if it is not known yet.

        fit: of straight driving. A car's stops and its driving know it equally well: both have the road's camber.
        """
        if self._up is not None:
            best = self._up
        elif self.vehicle == CAR and not self.standing.stops:
            return False
        elif fit is None:
            best = self.standing.up if self.vehicle == CAR else self._mean
        elif self.vehicle == CAR:
            best = [self.standing.up[i] + fit.level[i] / norm(fit.level) for i in range(3)]
        else:
            best = fit.level
        if best is None:
            return False
        for i in range(3):
            out[i] = best[i]
        normalize(out)
        return True

    def matrix(self, out):
        """Fill out (9, rows left, up, forward) with vehicle-from-sensor. Raises AlignmentError while not ready."""
        if not self.ready:
            raise self.reason
        up, left, forward = vector(), vector(), vector()
        self.vertical(up, self.quality.fit)
        cross(left, up, self.quality.fit.forward)
        normalize(left)
        cross(forward, left, up)
        for row, axis in enumerate((left, up, forward)):
            for i in range(3):
                out[3 * row + i] = axis[i]

    def _interrupt(self):
        """Samples are missing: what follows does not join what came before."""
        self._sums = [0.0] * 6
        self._sums_us = 0
        self._history.clear()
        self._work = None
        self.events.interrupt()

    def _end_bin(self):
        if self._bin is not None:
            self._piece()
        sums, n = self._sums, self._sums_us
        seconds = n * 1e-6
        means = [total / n for total in sums]
        force, rate = means[:3], means[3:]
        self._mean = self._mean or vector()
        self._mean_s = min(MEAN_S, self._mean_s + seconds)
        gain = seconds / self._mean_s
        for i in range(3):
            self._mean[i] += gain * (force[i] - self._mean[i])
        up = self.standing.up if self.standing.stops and self.vehicle == CAR else self._up or self._mean
        bias = self.standing.bias
        turned = (rate[0] - bias[0]) * up[0] + (rate[1] - bias[1]) * up[1] + (rate[2] - bias[2]) * up[2]
        self._history.add(sums, turned * seconds * 1e5, n)
        if self._quiet_us < STALE_US:  # a silent source is not a stuck one
            self._speed_check.update(force, turned, n)
        self._bin = (force, rate, seconds)
        self._quiet_us = min(STALE_US + 1, self._quiet_us + n)
        self._sums_us = 0
        for i in range(6):
            sums[i] = 0.0

    def _follow(self):
        """Work on the last interval between two speeds; a generator of short pieces."""
        yield from self.events.follow(self._bias_known or self.standing.stops)
        judged = (self.events.count, self.standing.stops)
        if judged != self._judged:
            self._judged = judged
            yield from self.quality.judge(self)
