"""How well driving knows forward, whether that is enough, and what is wrong with the speed or with the mount."""

from math import atan2, degrees, sqrt

from ..errors import AlignmentError
from ..rotation import angle_deg, cross, dot, norm, normalize, vector
from .parts import DriveParts, apart, usual
from .regression import Fit

NEEDED = 5  # brakings and starts
CHECKED = 2  # of them show whether the speed is one
MAX_STARTS = 2  # count: the others are brakings
HALVES_DEG, HALVES_STAY_DEG = 4.0, 6.0  # two halves of a drive may disagree by so much to become ready, to stay so
READY_DEG, READY_STAY_DEG = 1.5, 2.5  # by experience one in ten is off by twice as much
CHANCE, CHANCE_STAY = 3.0, 4.0  # sigmas: parts of a drive may differ by so much, or by HALVES_DEG
MOVED_DEG = 30.0  # two parts of a drive; a highway's long banked curve, taken for straight, made 15
LEVEL_DEG = 8.0  # two halves of a drive, or standing and driving: hills are not so different
PITCH_DEG = 7.0  # two parts of a drive: 6 % up, then down
ROLL_DEG = 7.0  # likewise: that road's curve made 6; a motorcycle leans, so not there
ELSEWHERE_DEG = 80.0  # one event from all; one of at least
MIN_WEIGHT = 0.012  # g^2 s and
SMALLEST = 0.5  # of the force that the speed says was never off by more than 40
MIN_SLOPE, MAX_SLOPE = 0.75, 1.35  # speed against force: pitch in braking and a coarse speed shift it by 0.2
MAX_LATE_S = 1.9


def speed_unit_problem(slope):
    """The speed does not change as the force says. slope: change of force per change of speed, 1 if all is well."""
    return AlignmentError("speed-unit", min(1.0 / max(slope, 0.01), 99.9))


class DrivingQuality:
    """fit: of all straight driving so far. quality_deg: standard error of its forward, 180 until there is one;
    halves_deg: how far two halves of the drive disagree about it; parts: the DriveParts; agree: halves and parts
    do; good: enough for an alignment; speed_problem (from CHECKED events on), mount_problem (from NEEDED on): an
    AlignmentError, or None.
    """

    def __init__(self):
        self.fit = Fit()
        self.quality_deg = self.halves_deg = 180.0
        self.good = self.agree = self._known = self._elsewhere = False
        self.speed_problem = self.mount_problem = None
        self.parts = DriveParts()
        self._part = Fit()

    def judge(self, drive):
        """After another event or stop of a DriveAlignment; a generator of short pieces."""
        regression, lag, part = drive.events.regression, drive.events.lag, self._part
        up = vector()
        if not (yield from regression.fitting(self.fit, lag)):
            return
        yield
        if not drive.vertical(up, self.fit):
            return
        left, forward = vector(), vector()
        cross(left, up, self.fit.forward)
        cross(forward, left, up)
        normalize(left)
        normalize(forward)
        yield
        blocks = regression.filled
        spread = slopes = weights = 0.0
        self.parts.clear()
        for block in range(blocks):
            if not (yield from regression.fitting(part, lag, block, block + 1)):
                continue
            x, y, weight = dot(left, part.forward), dot(forward, part.forward), part.weight
            yield
            level = part.level
            self.parts.add(x, y, dot(left, level), dot(forward, level), weight, part.seconds)
            slope = sqrt(x * x + y * y)
            slopes += weight * slope
            weights += weight
            if blocks > 1 and (yield from regression.fitting(part, lag, 0, blocks, block)):
                angle = atan2(dot(left, part.forward), dot(forward, part.forward))
                spread += angle * angle
            yield
        if blocks < 2 or weights <= 0.0:
            return
        # the jackknife: empirical, where a formal error is optimistic early
        free = blocks - 1
        self.quality_deg = sqrt(usual(degrees(degrees(spread)) * free / blocks, self.fit.weight, free))
        yield from self.parts.compare()
        half = blocks // 2
        if (yield from regression.fitting(part, lag, 0, half)):
            one = atan2(dot(left, part.forward), dot(forward, part.forward))
            level = vector(part.level[0], part.level[1], part.level[2])
            yield
            if (yield from regression.fitting(part, lag, half, blocks)):
                two = atan2(dot(left, part.forward), dot(forward, part.forward))
                self.halves_deg = degrees(apart(one, two))
                yield
                self._decide(drive, slopes / weights, angle_deg(level, part.level))

    def _decide(self, drive, slope, level_deg):
        """slope: force per change of speed; level_deg: between the verticals of two halves of the drive."""
        self.speed_problem = self.mount_problem = None
        self.good = False
        lag_s = drive.events.lag_s
        if drive.counted < CHECKED:
            return
        if lag_s >= MAX_LATE_S:
            self.speed_problem = AlignmentError("speed-late", lag_s)
        elif not MIN_SLOPE < slope < MAX_SLOPE:
            self.speed_problem = speed_unit_problem(slope)
        if drive.counted < NEEDED:
            return
        before, since = drive.known_vertical()
        from_driving = 0.0 if before is None else angle_deg(before, self.fit.level)
        parts = self.parts
        if level_deg > LEVEL_DEG:
            self.mount_problem = AlignmentError("mount-moved", "vertical", level_deg)
        elif from_driving > LEVEL_DEG:
            self.mount_problem = AlignmentError("mount-moved", since, from_driving)
        elif drive.vehicle == "car" and (parts.roll_deg > ROLL_DEG or parts.pitch_deg > PITCH_DEG):
            self.mount_problem = AlignmentError("mount-moved", "vertical-in-parts")
        elif self._look_at(drive.events.last) or (parts.forward_deg > MOVED_DEG and parts.sigmas > CHANCE_STAY):
            self.mount_problem = AlignmentError("mount-moved", "forward")
        # each with a hysteresis of its own: what comes and goes at a threshold helps nobody
        limit_deg, chance = (HALVES_STAY_DEG, CHANCE_STAY) if self.agree else (HALVES_DEG, CHANCE)
        self.agree = self.halves_deg <= limit_deg and (parts.forward_deg <= limit_deg or parts.sigmas <= chance)
        self._known = self.quality_deg <= (READY_STAY_DEG if self._known else READY_DEG)
        self.good = self._known and self.agree

    def _look_at(self, last):
        """True if the last event that says anything for itself says that forward is no longer where it was."""
        forward = vector()
        if last.forward(forward, self.fit.level) > MIN_WEIGHT and norm(forward) > SMALLEST:
            self._elsewhere = angle_deg(forward, self.fit.forward) > ELSEWHERE_DEG
        return self._elsewhere
