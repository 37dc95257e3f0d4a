"""Judges the quality of a drive, and finds faults of the speed or of the mount.

A block has the sums of a few braking and acceleration events (a regression block, see events.py). The halves of a drive
are the first and the second half of its blocks. The parts of a drive are the blocks before and after one boundary
between two blocks. DriveParts tries every boundary.
"""

from array import array
from math import atan2, degrees, pi, sqrt

from ..calibration.vectors import angle_deg, dot, frame, norm
from ..errors import Refusal
from ..rotation import matrix, vector
from ..units import const
from .events import BLOCKS, Fit

PRIOR_DEG = 1.0  # prior of the standard deviation of forward, at a weight of 1 g^2 s
PRIOR_FREEDOM = 4
# Standard deviation of forward that camber and wind cause on one stretch of road. This part does not depend on the
# weight.
STRETCH_DEG = 1.5
_MIN_WEIGHT = const(0.1)  # the forward of a part with a smaller weight (g^2 s) is not compared
_MIN_S = const(20.0)  # the vertical of a part with less straight driving is not compared
_MIN_BLOCKS = const(4)  # with fewer blocks in the drive, forward is not compared
# Largest difference of two verticals that the road's slope can cause (14 %). If two verticals differ more, the mount
# moved.
MAX_CHANGE_DEG = 8.0


def angle_between(a, b):
    """Return the angle between two directions in rad, from 0 to pi.

    Args:
        a, b: the directions as angles in rad.
    """
    angle = abs(a - b)
    return min(angle, 2 * pi - angle)


def blend_prior(variance, weight, freedom):
    """Average the sample variance of forward with its prior variance. Return the result in deg^2.

    Args:
        variance: the sample variance in deg^2.
        weight: weight of the events that forward was computed from, in g^2 s.
        freedom: degrees of freedom of the sample variance.
    """
    return (freedom * variance + PRIOR_FREEDOM * PRIOR_DEG * PRIOR_DEG / weight) / (freedom + PRIOR_FREEDOM)


class DriveParts:
    """Compares forward and the vertical between two parts of a drive. If forward or the vertical differs, the mount may
    have moved between the two parts.

    The time of a move is unknown, so the drive is split in two after each block, one block after the other. The scatter
    of forward between the blocks within each part shows which difference is likely by chance. The variance of a part's
    forward falls with the part's weight, but not below the effect of camber and wind on one long stretch of road. A few
    blocks give a poor sample variance, so it is averaged with a prior of PRIOR_FREEDOM degrees of freedom.

    Call clear(), add() each block in chronological order, and run compare() to its end.

    Attributes, after compare():
        forward_deg: difference of forward between the two parts, for the split with the most significant difference.
        sigmas: the same difference in standard deviations.
        roll_deg, pitch_deg: largest differences of the vertical between the two parts, over all splits.
        count: number of blocks.
    """

    def __init__(self):
        self._blocks = [array("f", [0.0] * 7) for _ in range(BLOCKS)]
        self.clear()

    def clear(self):
        """Drop all blocks. Call this method before the first add()."""
        self.count = 0
        self.forward_deg = self.sigmas = self.roll_deg = self.pitch_deg = 0.0

    def add(self, across, along, roll_g, pitch_g, weight, seconds):
        """Add one block of events.

        The components are relative to forward of the whole drive.

        Args:
            across, along: the components of the block's forward to the left and forward, in g per g.
            roll_g, pitch_g: the components of the block's vertical to the left and forward, in g.
            weight, seconds: as in the block's Fit.
        """
        sums = weight * across, weight * along, seconds * roll_g, seconds * pitch_g
        for i, value in enumerate(sums + (weight, seconds, weight * weight)):
            self._blocks[self.count][i] = value
        self.count += 1

    def compare(self):
        """Compare the two parts of each split, as a generator of short steps."""
        for split in range(1, self.count):
            first = self._sums(0, split)
            yield
            second = self._sums(split, self.count)
            yield
            if first[5] >= _MIN_S and second[5] >= _MIN_S:
                roll, pitch = [degrees(abs(first[i] / first[5] - second[i] / second[5])) for i in (2, 3)]
                self.roll_deg, self.pitch_deg = max(self.roll_deg, roll), max(self.pitch_deg, pitch)
            if self.count < _MIN_BLOCKS or first[4] < _MIN_WEIGHT or second[4] < _MIN_WEIGHT:
                continue
            first_angle, second_angle = atan2(first[0], first[1]), atan2(second[0], second[1])
            scatter = self._scatter(first_angle, 0, split)
            yield
            scatter += self._scatter(second_angle, split, self.count)
            yield
            freedom = self.count - 2  # two degrees of freedom less, because the scatter is about two means
            variance = 0.0
            for part in first, second:
                variance += STRETCH_DEG * STRETCH_DEG * part[6] / (part[4] * part[4])
                variance += blend_prior(scatter / part[4] / freedom, part[4], freedom)
            difference_deg = degrees(angle_between(first_angle, second_angle))
            if difference_deg > self.sigmas * sqrt(variance):
                self.sigmas = difference_deg / sqrt(variance)
                self.forward_deg = difference_deg
            yield

    def _sums(self, first, last):
        """Return the sums of the 7 values of the blocks from first to last - 1."""
        return [sum([block[i] for block in self._blocks[first:last]]) for i in range(7)]

    def _scatter(self, angle, first, last):
        """Return the scatter of forward about an angle: the sum of weight times squared deviation in deg^2, over the
        blocks from first to last - 1."""
        total = 0.0
        for block in self._blocks[first:last]:
            off = degrees(angle_between(angle, atan2(block[0], block[1])))
            total += block[4] * off * off
        return total


_NEGATIVE_MPS = const(-0.5)  # a speed of 0 to this may be noise of a standing vehicle
# A second is lively if its mean force differs by more than _LIVELY_G from the mean force of the previous second. At
# standstill no second is lively. While driving, most seconds are lively.
_LIVELY_G = const(0.03)
# A second with a larger yaw rate and the second after it do not count, because the force changes in a bend too.
_TURNING_DPS = const(5.0)
# The speed is stuck if it has not changed for at least _STUCK_S lively seconds, and at least _STUCK_SHARE of all
# seconds since its last change are lively. Four braking events together have 8 lively seconds.
_STUCK_S = const(8)
_STUCK_SHARE = const(0.15)
# Limits of the ratio between the change of force and the change of speed. The ratio should be 1. The pitch of a braking
# vehicle and a coarsely rounded speed shift the ratio by 0.2.
MIN_FORCE_RATIO, MAX_FORCE_RATIO = 0.75, 1.35
MAX_LAG_S = 1.9


def speed_unit_problem(force_ratio):
    """Return the Refusal for changes of speed that do not fit the force.

    Args:
        force_ratio: change of force per change of speed.
    """
    return Refusal("speed-unit", min(1.0 / max(force_ratio, 0.01), 99.9))


def fit_problem(lag_s, force_ratio):
    """Return a Refusal if the regression of force on change of speed shows a fault of the speed, else None.

    Args:
        lag_s: lag of the speed in seconds.
        force_ratio: change of force per change of speed.
    """
    if lag_s >= MAX_LAG_S:
        return Refusal("speed-late", lag_s)
    if not MIN_FORCE_RATIO < force_ratio < MAX_FORCE_RATIO:
        return speed_unit_problem(force_ratio)
    return None


class SpeedCheck:
    """Finds a negative or stuck speed. The check does not need to know forward.

    Attributes:
        problem: a Refusal, or None.
    """

    def __init__(self):
        self.problem = None
        self._speed = self._force = None
        self._yaw_dps = 0.0
        self._sums, self._sums_us = [0.0] * 4, 0
        self._start_count()

    def _start_count(self):
        """Restart the count of lively seconds, because the speed has changed."""
        self._seconds = self._lively_seconds = 0

    def measure(self, speed_mps):
        """Take a new value of the speed source."""
        if not speed_mps >= _NEGATIVE_MPS:  # also rejects NaN
            self.problem = Refusal("speed-negative", speed_mps)
        if speed_mps != self._speed:
            self._speed = speed_mps
            self._start_count()

    def update(self, force, yaw_dps, dt_us):
        """Take the means over the last dt_us.

        Args:
            force: mean force, 3 values in g.
            yaw_dps: mean yaw rate in deg/s.
            dt_us: microseconds.
        """
        sums = self._sums
        for i in range(3):
            sums[i] += force[i] * dt_us
        sums[3] += abs(yaw_dps) * dt_us
        self._sums_us += dt_us
        if self._sums_us < 1_000_000:
            return
        *mean, yaw_dps = [total / self._sums_us for total in sums]  # over the last second
        self._sums, self._sums_us = [0.0] * 4, 0
        previous, self._force = self._force, mean
        turning = max(yaw_dps, self._yaw_dps) > _TURNING_DPS
        self._yaw_dps = yaw_dps
        if previous is None or self._speed is None or turning:
            return
        self._seconds += 1
        if norm([mean[i] - previous[i] for i in range(3)]) > _LIVELY_G:
            self._lively_seconds += 1
        if self._lively_seconds >= _STUCK_S and self._lively_seconds >= _STUCK_SHARE * self._seconds:
            self.problem = Refusal("speed-stuck", self._speed)


MIN_EVENTS = 5  # number of straight braking and acceleration events needed for an alignment
MIN_EVENTS_TO_CHECK_SPEED = 2
# Each of the next three pairs has the limit to become ready and a wider limit to stay ready, to avoid flicker.

# Largest standard error of forward. In one of ten drives, the real error of forward is twice the standard error
READY_DEG, STAY_READY_DEG = 1.5, 2.5
# Largest angle between the forward directions of the two halves. The limits also hold for the angle between the two
# parts of a drive
AGREE_DEG, STAY_AGREE_DEG = 4.0, 6.0
# Largest difference between two parts in standard deviations of the difference, if it exceeds the limit in degrees
AGREE_SIGMAS, STAY_AGREE_SIGMAS = 3.0, 4.0
# The mount moved if two parts differ by more than one of the next three limits
# Difference of forward. A long banked motorway curve that was treated as straight caused a difference of 15 degrees
_MOVED_DEG = const(30.0)
PITCH_DEG = 7.0  # difference of pitch. A road that climbs by 6 % and then falls by 6 % causes a smaller difference
# Difference of roll, for a car only, because a motorcycle leans. The same motorway curve caused a difference of 6
# degrees
ROLL_DEG = 7.0
# The mount moved if forward from one event differs by over _EVENT_OFF_DEG from forward of the whole drive. An event is
# judged only if its weight and the length of its forward exceed _MIN_EVENT_WEIGHT and _MIN_EVENT_FORWARD. On recorded
# drives no such event differed by more than 40 degrees.
_EVENT_OFF_DEG = const(80.0)
_MIN_EVENT_WEIGHT = const(0.012)  # an event with a smaller weight (g^2 s) is not judged
_MIN_EVENT_FORWARD = const(0.5)  # smallest length of an event's forward, in g per g


class DrivingQuality:
    """The quality of a drive.

    Args:
        events: the DrivingEvents of the drive.
        vertical: the Vertical of the drive.

    Attributes:
        fit: the Fit of all straight driving so far.
        quality_deg: standard error of the fit's forward in degrees; 180 before the first estimate.
        halves_deg: angle in degrees between forward from the first half and from the second half of the drive.
        parts: the DriveParts.
        agree: True if forward is the same in both halves and in all parts, within the limits.
        good: True if the quality is good enough for an alignment.
        speed_problem: a Refusal for a fault of the speed, or None.
        speed_confirmed: True if enough events agree with the speed.
        mount_problem: a Refusal for a fault of the mount, or None.
    """

    def __init__(self, events, vertical):
        self.fit = Fit()
        self.quality_deg = self.halves_deg = 180.0
        self.good = self.agree = self.speed_confirmed = False
        self.speed_problem = self.mount_problem = None
        self.parts = DriveParts()
        self._events = events
        self._vertical = vertical
        self._precise = self._event_off = False
        self._scratch_fit = Fit()

    def judge(self):
        """Update all attributes after another event or stop, as a generator of short steps."""
        regression, lag, part = self._events.regression, self._events.lag, self._scratch_fit
        up = vector()
        if not (yield from regression.fitting(self.fit, lag)):
            return
        yield
        if not self._vertical.known(up, self.fit):
            return
        axes = matrix()
        frame(axes, up, self.fit.forward)
        left, forward = axes[0:3], axes[6:9]
        yield
        blocks = regression.filled
        squares = ratios = weights = 0.0
        self.parts.clear()
        for block in range(blocks):
            if not (yield from regression.fitting(part, lag, block, block + 1)):
                continue
            x, y, weight = dot(left, part.forward), dot(forward, part.forward), part.weight
            yield
            self.parts.add(x, y, dot(left, part.level), dot(forward, part.level), weight, part.seconds)
            ratios += weight * sqrt(x * x + y * y)
            weights += weight
            if blocks > 1 and (yield from regression.fitting(part, lag, 0, blocks, block)):
                squares += part.angle(left, forward) ** 2
            yield
        if blocks < 2 or weights <= 0.0:
            return
        # Jackknife. One block after the other is left out, and the changes of forward give its variance. The formal
        # error of the regression is not used, because it is too small early in a drive.
        freedom = blocks - 1
        variance = degrees(degrees(squares)) * freedom / blocks  # rad^2 to deg^2
        self.quality_deg = sqrt(blend_prior(variance, self.fit.weight, freedom))
        yield from self.parts.compare()
        half = blocks // 2
        if (yield from regression.fitting(part, lag, 0, half)):
            angle, level = part.angle(left, forward), part.level[:]
            yield
            if (yield from regression.fitting(part, lag, half, blocks)):
                self.halves_deg = degrees(angle_between(angle, part.angle(left, forward)))
                yield
                self._decide(ratios / weights, angle_deg(level, part.level))

    def _decide(self, force_ratio, level_change_deg):
        """Set agree, good and the problems.

        Args:
            force_ratio: change of force per change of speed.
            level_change_deg: angle between the verticals of the two halves in degrees.
        """
        self.speed_problem = self.mount_problem = None
        self.good = False
        counted = self._events.counted
        if counted < MIN_EVENTS_TO_CHECK_SPEED:
            return
        self.speed_problem = fit_problem(self._events.lag_s, force_ratio)
        self.speed_confirmed = self.speed_problem is None
        if counted < MIN_EVENTS:
            return
        self.mount_problem = self._find_mount_problem(level_change_deg)
        parts = self.parts
        limit_deg, sigmas = (STAY_AGREE_DEG, STAY_AGREE_SIGMAS) if self.agree else (AGREE_DEG, AGREE_SIGMAS)
        self.agree = self.halves_deg <= limit_deg and (parts.forward_deg <= limit_deg or parts.sigmas <= sigmas)
        self._precise = self.quality_deg <= (STAY_READY_DEG if self._precise else READY_DEG)
        self.good = self._precise and self.agree

    def _find_mount_problem(self, level_change_deg):
        """Return a Refusal if the mount has moved, else None."""
        parts = self.parts
        if level_change_deg > MAX_CHANGE_DEG:
            return Refusal("mount-moved", "vertical", level_change_deg)
        problem = self._vertical.problem(self.fit.level)
        if problem is not None:
            return problem
        if self._vertical.is_car and (parts.roll_deg > ROLL_DEG or parts.pitch_deg > PITCH_DEG):
            return Refusal("mount-moved", "parts")
        if self._is_last_event_off() or (parts.forward_deg > _MOVED_DEG and parts.sigmas > STAY_AGREE_SIGMAS):
            return Refusal("mount-moved", "forward")
        return None

    def _is_last_event_off(self):
        """Return True if the latest event that can be judged shows another forward than the whole drive."""
        forward, last = vector(), self._events.last
        if last.forward(forward, self.fit.level) > _MIN_EVENT_WEIGHT and norm(forward) > _MIN_EVENT_FORWARD:
            self._event_off = angle_deg(forward, self.fit.forward) > _EVENT_OFF_DEG
        return self._event_off
