"""Aligns the sensor by driving. Standing and driving straight show the vertical, and braking shows forward.

The module improves the method that ViriCiti published. Forward comes from a regression of force on change of speed. The
intercept of the regression absorbs forces that are not braking. Bends are excluded, the lag of the speed is estimated,
and the result has a standard error.

    drive = DriveAlignment("car")                  # or ("motorcycle", up) with the vertical from two poses
    drive.update(force, rate, dt_us)               # about 100 times per second, in the sensor's axes
    drive.measure_speed(speed_mps, age_us)         # for each new value of the speed source, 1 to 10 times per second
    if drive.ready: drive.matrix(out)

To show the progress, use `state`, `counted`, `needed` and, in the state REFUSED, `problem`. A problem is a fault of the
speed or of the mount that more driving cannot resolve. missing() describes the driving that is still needed. `reason`
is the problem or, without one, the result of missing(). compare() checks whether an earlier alignment still
fits. Memory is fixed, and each call does a short step of the work.
"""

from math import atan2, degrees

from ..errors import Refusal
from ..rotation import angle_deg, dot, frame, vector
from ..units import GAP_US, const
from .events import BIN_US, DrivingEvents, Fit, ForceHistory
from .quality import MIN_EVENTS, DrivingQuality, SpeedCheck
from .vertical import COUNTS_S, MAX_CHANGE_DEG, MOVED_MPS, SETTLE_S, StandingVertical, Vertical

CAR, MOTORCYCLE = "car", "motorcycle"

# state
WAITING_FOR_SPEED = 0  # no speed has come yet, or no new speed for STALE_US
WAITING_FOR_STOP = 1  # only in a car, whose vertical and gyro bias are measured at a stop
WAITING_FOR_BRAKING = 2  # waiting for a braking event, which must be in a straight line
BRAKING = 3  # a braking event in a straight line
TURNING = 4  # a braking event in a bend, which will not count
READY = 5  # matrix() gives the alignment; more events improve it
REFUSED = 6  # matrix() raises `problem`

STALE_US = 5_000_000
STEP_US = 12_000  # an update does one step of work, plus one step for each whole STEP_US since the last update


class DriveAlignment:
    """One drive.

    Args:
        vehicle: CAR or MOTORCYCLE.
        up: for a motorcycle, the vertical from two poses, a unit vector in the sensor's axes. If `up` is None, the
            vertical comes from riding straight.
        bias: the gyro's bias, 3 values in deg/s, or None. This bias is subtracted until a stop measures a newer bias.
            Pass zeros if the rates are already corrected. Without a bias no braking event counts before the first stop.

    Attributes:
        standing: the StandingVertical, which also has the gyro's bias.
        vertical: the Vertical.
        events: the DrivingEvents.
        quality: the DrivingQuality.
        needed: number of counted events that an alignment needs.
    """

    def __init__(self, vehicle, up=None, bias=None):
        self._leans = vehicle == MOTORCYCLE
        self.needed = MIN_EVENTS
        self.standing = StandingVertical(bias or (0.0, 0.0, 0.0))
        self.vertical = Vertical(not self._leans, up, self.standing)
        self._history = ForceHistory()
        self.events = DrivingEvents(self._history)
        self.quality = DrivingQuality(self.events, self.vertical)
        self._speed_check = SpeedCheck()
        self._bias_given = bias is not None
        self._judged = (0, 0)  # numbers of events and stops when the quality was last judged
        self._clear_bin()
        self._speed_mps = -1.0  # the last speed in m/s, negative before the first speed
        self._top_mps = 0.0
        self._silent_us = 0  # time since the last speed, in us
        self._means = None  # means of force and rate over the last bin, None after they are processed
        self._work = None  # the generator _follow(), None when it has finished

    @property
    def counted(self):
        """The number of events that count for the alignment."""
        return self.events.counted

    @property
    def turned(self):
        """The number of braking events that did not count because of a bend."""
        return self.events.turning_count

    @property
    def quality_deg(self):
        """The standard error of forward's direction in degrees. The value is 180 before the first estimate."""
        return self.quality.quality_deg

    @property
    def state(self):
        """The state of the drive, one of this module's constants from WAITING_FOR_SPEED on."""
        if self.problem is not None:
            return REFUSED
        if self.ready:
            return READY
        if self._speed_mps < 0.0 or self._silent_us > STALE_US:
            return WAITING_FOR_SPEED
        if not (self._leans or self.standing.stops):
            return WAITING_FOR_STOP
        if not self.events.braking:
            return WAITING_FOR_BRAKING
        return BRAKING if self.events.straight else TURNING

    @property
    def ready(self):
        """True while matrix() gives an alignment."""
        return self.quality.good and self.problem is None

    @property
    def problem(self):
        """The fault of the speed or of the mount that more driving cannot resolve, a Refusal, or None."""
        if self._speed_check.problem is None and self.standing.moved and not self._leans:
            return Refusal("mount-moved", "between-stops", MAX_CHANGE_DEG)
        if self.counted < self.needed:
            return self._speed_check.problem
        return self._speed_check.problem or self.quality.mount_problem or self.quality.speed_problem

    @property
    def reason(self):
        """The reason why matrix() gives no alignment, a Refusal: `problem`, or else the result of missing()."""
        return self.problem or self.missing(self.counted, self.needed, self.turned)

    def missing(self, counted, needed, turned):
        """Return a Refusal that says which driving is still needed. The drive must not have a problem.

        Args:
            counted: number of counted events.
            needed: number of events that an alignment needs.
            turned: number of braking events that did not count because of a bend.
        """
        if self._speed_mps < 0.0:
            return Refusal("no-speed")
        if self._top_mps < MOVED_MPS:
            return Refusal("not-driven", needed)
        if not (self._leans or self.standing.stops):
            return Refusal("not-stopped", SETTLE_S + COUNTS_S)
        if counted < needed:
            return Refusal("few-events", counted, needed, turned)
        quality = self.quality
        if not quality.agree and quality.quality_deg < 180.0:
            return Refusal("parts-differ", max(quality.parts.forward_deg, quality.halves_deg))
        return Refusal("uncertain", min(quality.quality_deg, 180.0), self.events.braking_count)

    def update(self, force, rate, dt_us):
        """Take a sample and do a step of the work.

        Args:
            force: calibrated force in the sensor's axes, 3 values in g.
            rate: calibrated rate in the sensor's axes, 3 values in deg/s.
            dt_us: microseconds since the previous sample, an integer.
        """
        if dt_us > GAP_US:
            self.interrupt()
            return
        sums = self._sums
        for i in range(3):
            sums[i] += force[i] * dt_us
            sums[3 + i] += rate[i] * dt_us
        if self.elapse(dt_us):
            means = [total / self._bin_us for total in sums]
            self.end_bin(means[:3], means[3:])

    def elapse(self, dt_us):
        """Count the time of a sample. Return True at the end of a bin, when end_bin() must follow; else do a step of
        the work."""
        self._bin_us += dt_us
        if self._bin_us >= BIN_US:
            return True
        for _ in range(1 + dt_us // STEP_US):
            self._do_step()
        return False

    def interrupt(self):
        """Drop the current braking event and the history, because samples are missing. Counted events are kept."""
        self._clear_bin()
        self._history.clear()
        self._work = None
        self.events.interrupt()

    def finish(self):
        """Do all pending work at once, because there are no more samples."""
        while self._means is not None or self._work is not None:
            self._do_step()

    def measure_speed(self, speed_mps, age_us=0):
        """Take a new value of the speed source.

        Args:
            speed_mps: the speed in m/s.
            age_us: the known age of the value. The drive estimates any further delay.
        """
        self._speed_check.measure(speed_mps)
        if not speed_mps >= 0.0:
            speed_mps = 0.0
        self._speed_mps = speed_mps
        if self._silent_us > STALE_US:  # after a long silence the history's time may have wrapped
            self.events.interrupt()
        self._silent_us = 0
        self._top_mps = max(self._top_mps, speed_mps)
        self.events.measure_speed(speed_mps, self._history.now + self._bin_us - age_us)

    def matrix(self, out):
        """Write the rotation from sensor axes to vehicle axes into out. Raises Refusal while not ready.

        Args:
            out: array of 9 for the rotation matrix, with the rows left, up, forward.
        """
        if not self.ready:
            raise self.reason
        up = vector()
        self.vertical.known(up, self.quality.fit)
        frame(out, up, self.quality.fit.forward)

    def _do_step(self):
        """Do one short step of work, if there is any."""
        if self._means is not None:
            force, rate, seconds = self._means
            self._means = None
            if self._speed_mps >= 0.0 and self._silent_us <= STALE_US:  # an old speed of 0 does not prove a standstill
                self.standing.update(force, rate, self._speed_mps, seconds)
        elif self._work is not None:
            if next(self._work, True):
                self._work = None
        elif self.events.due:
            self._work = self._follow()

    def end_bin(self, force, rate):
        """Take the means over the time since the last bin. force, rate: two lists, as for update()."""
        if self._means is not None:
            self._do_step()
        n = self._bin_us
        seconds = n * 1e-6
        self.vertical.update(force, seconds)
        axis, bias = self.vertical.turn_axis, self.standing.bias
        yaw_dps = (rate[0] - bias[0]) * axis[0] + (rate[1] - bias[1]) * axis[1] + (rate[2] - bias[2]) * axis[2]
        self._history.add([f * n for f in force], yaw_dps * seconds * 1e5, n)
        if self._silent_us < STALE_US:  # a silent source must not be reported as a stuck source
            self._speed_check.update(force, yaw_dps, n)
        self._means = (force, rate, seconds)
        self._silent_us = min(STALE_US + 1, self._silent_us + n)
        self._clear_bin()

    def _clear_bin(self):
        self._sums = [0.0] * 6  # integrals of force and rate over the current bin
        self._bin_us = 0

    def _follow(self):
        """Process the last interval between two speeds, as a generator of short steps."""
        yield from self.events.follow(self._bias_given or self.standing.stops)
        judged = (self.events.straight_count, self.standing.stops)
        if judged != self._judged:
            self._judged = judged
            yield from self.quality.judge()


UNKNOWN = 0  # too few events for a verdict
SAME = 1
REFINED = 2  # the earlier alignment has a yaw error of a few degrees, and the DriveAlignment's matrix() is better
REVERSED = 3  # forward points backward, and turn_round() corrects the matrix
MOVED = 4  # the mount has moved, and the sensor must be aligned again

# Smallest number of straight events that can show REVERSED; each of them must show it
_MIN_EVENTS_TO_REVERSE = const(2)
_SAME_DEG = const(1.0)  # smallest yaw error that is corrected
# Largest yaw error of two poses. At the smallest allowed tilt, 2 degrees of pitch between the poses cause a yaw error
# of 22 degrees.
_REFINED_DEG = const(30.0)
_REVERSED_DEG = const(135.0)  # smallest yaw error that means REVERSED
# Largest difference between the two verticals. An inexact upright pose and the road's camber cause a smaller
# difference.
_UPRIGHT_DEG = const(8.0)


def compare(drive, matrix):
    """Check whether an earlier alignment, from two poses or another drive, fits this drive. Return UNKNOWN, SAME,
    REFINED, REVERSED or MOVED.

    If SIDE in the settings is not the side of the kickstand, forward and backward are exchanged. The poses cannot show
    this exchange, but the first braking events do. A change of pitch between the poses causes a yaw error of a few
    degrees. This yaw error is corrected after enough braking events. Any other difference means that the mount has
    moved.

    Args:
        drive: a DriveAlignment.
        matrix: the earlier alignment, 9 values with the rows left, up, forward.
    """
    events, quality = drive.events, drive.quality
    if quality.speed_problem is not None or events.straight_count < _MIN_EVENTS_TO_REVERSE:
        return UNKNOWN
    yaw = abs(yaw_deg(quality.fit, matrix))
    if yaw > _REVERSED_DEG and _all_backward(events, matrix):
        return REVERSED
    if drive.counted < drive.needed:
        return UNKNOWN
    if angle_deg(quality.fit.level, matrix[3:6]) > _UPRIGHT_DEG:
        return MOVED
    if not drive.ready:
        return UNKNOWN
    if yaw > _REFINED_DEG:
        return MOVED
    return REFINED if yaw > max(_SAME_DEG, quality.quality_deg) else SAME


def yaw_deg(fit, matrix):
    """Return the yaw error of a matrix in degrees.

    The yaw error is the angle from the matrix's forward to the Fit's forward, about the matrix's up. The yaw error is
    positive if the Fit's forward is farther to the left."""
    return degrees(atan2(dot(matrix[0:3], fit.forward), dot(matrix[6:9], fit.forward)))


def _all_backward(events, matrix):
    """Return True if in each block of a drive the matrix's forward points backward.

    Args:
        events: the DrivingEvents of the drive.
        matrix: the alignment.
    """
    regression, part = events.regression, Fit()
    for block in range(regression.filled):
        if regression.fit(part, events.lag, block, block + 1) and abs(yaw_deg(part, matrix)) < 90.0:
            return False
    return True


def turn_round(matrix):
    """Reverse forward and left in place. The same poses give this alignment if SIDE is the other side."""
    for i in (0, 1, 2, 6, 7, 8):
        matrix[i] = -matrix[i]
