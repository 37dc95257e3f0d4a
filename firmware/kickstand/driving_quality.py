"""How well driving knows forward, whether that is enough, and what is wrong with the speed or with the mount."""

from math import atan2, degrees, pi, sqrt

from .braking_regression import Fit
from .driving_reasons import HALVES_DEG, late, moved, units
from .rotation import angle_deg, cross, dot, normalize, vector

NEEDED = 5  # brakings and starts
MAX_STARTS = 2  # count: the others are brakings
HALVES_STAY_DEG = 6.0  # to become ready it takes HALVES_DEG
READY_DEG, READY_STAY_DEG = 2.0, 3.0
LEVEL_DEG = 8.0  # two halves of a drive, or standing and driving: hills are not so different
OUTLIER_DEG = 30.0  # of one braking from the others; camber and wind make 10
MIN_WEIGHT = 0.05  # g^2 s: half a second at 0.3 g
CHECKED = 3  # before, units and lag of the speed are not judged
MIN_SLOPE, MAX_SLOPE = 0.75, 1.35  # speed against force: pitch in braking and a coarse speed shift it by 0.2
MAX_LATE_S = 1.9


class DrivingQuality:
    """fit: of all straight driving so far. quality_deg: standard error of its forward, 180 until there is one;
    halves_deg: how far two halves of the drive disagree about it; good: enough for an alignment; speed_problem,
    mount_problem: an AlignmentError, or None.
    """

    def __init__(self):
        self.fit = Fit()
        self.quality_deg = self.halves_deg = 180.0
        self.good = False
        self.speed_problem = self.mount_problem = None
        self._part = Fit()

    def judge(self, drive):
        """After another event or stop of a DriveAlignment; a generator of short pieces."""
        regression, lag, part = drive.events.regression, drive.events.lag, self._part
        up = vector()
        if not (yield from regression.fitting(self.fit, lag)):
            return
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
        outlier_deg = 0.0
        for block in range(blocks):
            if not (yield from regression.fitting(part, lag, block, block + 1)):
                continue
            x, y, weight = dot(left, part.forward), dot(forward, part.forward), part.weight
            yield
            slope = sqrt(x * x + y * y)
            slopes += weight * slope
            weights += weight
            if blocks > 1 and (yield from regression.fitting(part, lag, 0, blocks, block)):
                p, q = dot(left, part.forward), dot(forward, part.forward)
                angle = atan2(p, q)
                spread += angle * angle
                others = p * p + q * q
                if weight > MIN_WEIGHT and MIN_SLOPE * MIN_SLOPE < others < MAX_SLOPE * MAX_SLOPE:
                    if MIN_SLOPE < slope < MAX_SLOPE:
                        outlier_deg = max(outlier_deg, degrees(_apart(angle, atan2(x, y))))
                    elif p * x + q * y < 0.5 * others:  # some brakings of this block point elsewhere
                        outlier_deg = 180.0
            yield
        if blocks < 2 or weights <= 0.0:
            return
        # the jackknife: empirical, where a formal error is optimistic early
        self.quality_deg = degrees(sqrt(spread * (blocks - 1) / blocks))
        half = blocks // 2
        if (yield from regression.fitting(part, lag, 0, half)):
            one = atan2(dot(left, part.forward), dot(forward, part.forward))
            level = vector(part.level[0], part.level[1], part.level[2])
            yield
            if (yield from regression.fitting(part, lag, half, blocks)):
                two = atan2(dot(left, part.forward), dot(forward, part.forward))
                self.halves_deg = degrees(_apart(one, two))
                self._decide(drive, slopes / weights, angle_deg(level, part.level), outlier_deg)

    def _decide(self, drive, slope, level_deg, outlier_deg):
        """slope: force per change of speed; level_deg: between the verticals of two halves of the drive; outlier_deg:
        of one block's forward from that of all others."""
        self.speed_problem = self.mount_problem = None
        counted, lag_s = drive.counted, drive.events.lag_s
        if counted >= NEEDED:
            before, what = drive.known_vertical()
            from_driving = 0.0 if before is None else angle_deg(before, self.fit.level)
            if level_deg > LEVEL_DEG:
                self.mount_problem = moved("the vertical changed by %.0f degrees during the drive" % level_deg)
            elif from_driving > LEVEL_DEG:
                self.mount_problem = moved("%s and driving differ by %.0f degrees" % (what, from_driving))
            elif outlier_deg > OUTLIER_DEG:
                self.mount_problem = moved("forward is no longer where it was")
        if counted >= CHECKED:
            if lag_s >= MAX_LATE_S:
                self.speed_problem = late(lag_s)
            elif not MIN_SLOPE < slope < MAX_SLOPE:
                self.speed_problem = units(slope)
        self.good = (
            counted >= NEEDED
            and self.halves_deg <= (HALVES_STAY_DEG if self.good else HALVES_DEG)
            and self.quality_deg <= (READY_STAY_DEG if self.good else READY_DEG)
        )


def _apart(a, b):
    """Angle between two directions, 0 to pi."""
    between = abs(a - b)
    return min(between, 2 * pi - between)
