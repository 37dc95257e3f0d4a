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

The vertical from standing is the mean direction of gravity over many stops. The slopes of many stops average out
(ViriCiti). Each stop counts once, independent of its duration. At a stop the gyro reads only its bias, which is
measured too. At a stop a motorcycle may lean to a side. So its vertical comes from the upright pose or, without this
pose, from riding straight, because a balanced bike has no lateral force. A car's vertical is the mean of two verticals,
from its stops and from driving straight. The camber and slope of the road disturb both verticals by about the same
amount.
"""

from math import atan2, degrees

from ..calibration.vectors import angle_deg, dot, frame, norm, normalize
from ..errors import Refusal
from ..rotation import vector
from ..units import GAP_US, const
from .events import BIN_US, DrivingEvents, Fit, ForceHistory
from .quality import MAX_CHANGE_DEG, MIN_EVENTS, DrivingQuality, SpeedCheck

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
        self._from_pose = None if from_pose is None else vector(*from_pose)
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
