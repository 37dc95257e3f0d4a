"""Judges a drive by the standard error of forward, and finds faults of the speed or of the mount.

A block has the sums of a few braking and acceleration events (a regression block, see regression.py). The halves of a
drive are the first and the second half of its blocks. The parts of a drive are the blocks before and after one boundary
between two blocks. parts.py tries every boundary.
"""

from math import atan2, degrees, sqrt

from ..errors import AlignmentError
from ..rotation import angle_deg, cross, dot, norm, normalize, vector
from ..units import const
from .parts import DriveParts, angle_between, blend_prior
from .regression import Fit
from .speed_check import fit_problem
from .vertical import MAX_CHANGE_DEG

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
        speed_problem: an AlignmentError for a fault of the speed, or None.
        speed_confirmed: True if enough events agree with the speed.
        mount_problem: an AlignmentError for a fault of the mount, or None.
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
        left, forward = vector(), vector()
        cross(left, up, self.fit.forward)
        cross(forward, left, up)
        normalize(left)
        normalize(forward)
        yield
        blocks = regression.filled
        squares = ratios = weights = 0.0
        self.parts.clear()
        for block in range(blocks):
            if not (yield from regression.fitting(part, lag, block, block + 1)):
                continue
            x, y, weight = dot(left, part.forward), dot(forward, part.forward), part.weight
            yield
            level = part.level
            self.parts.add(x, y, dot(left, level), dot(forward, level), weight, part.seconds)
            ratios += weight * sqrt(x * x + y * y)
            weights += weight
            if blocks > 1 and (yield from regression.fitting(part, lag, 0, blocks, block)):
                angle = atan2(dot(left, part.forward), dot(forward, part.forward))
                squares += angle * angle
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
            angle = atan2(dot(left, part.forward), dot(forward, part.forward))
            level = vector(part.level[0], part.level[1], part.level[2])
            yield
            if (yield from regression.fitting(part, lag, half, blocks)):
                second_angle = atan2(dot(left, part.forward), dot(forward, part.forward))
                self.halves_deg = degrees(angle_between(angle, second_angle))
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
        """Return an AlignmentError if the mount has moved, else None."""
        parts = self.parts
        if level_change_deg > MAX_CHANGE_DEG:
            return AlignmentError("mount-moved", "vertical", level_change_deg)
        problem = self._vertical.problem(self.fit.level)
        if problem is not None:
            return problem
        if self._vertical.is_car and (parts.roll_deg > ROLL_DEG or parts.pitch_deg > PITCH_DEG):
            return AlignmentError("mount-moved", "parts")
        if self._is_last_event_off() or (parts.forward_deg > _MOVED_DEG and parts.sigmas > STAY_AGREE_SIGMAS):
            return AlignmentError("mount-moved", "forward")
        return None

    def _is_last_event_off(self):
        """Return True if the latest event that can be judged shows another forward than the whole drive."""
        forward, last = vector(), self._events.last
        if last.forward(forward, self.fit.level) > _MIN_EVENT_WEIGHT and norm(forward) > _MIN_EVENT_FORWARD:
            self._event_off = angle_deg(forward, self.fit.forward) > _EVENT_OFF_DEG
        return self._event_off
