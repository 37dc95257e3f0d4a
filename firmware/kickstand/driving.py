"""Sensor to vehicle from driving: vertical from standing and straight driving, forward from braking (ViriCiti).

The published method (driving_published.py) put right: forward is regressed on the change of speed, with what is not
braking taken up by an intercept; turns are left out; the lag of the speed is found; it says how good it is.

    drive = DriveAlignment("car")                  # or ("motorcycle", up): the two presses gave the vertical
    drive.update(force, rate, dt_us)               # some 100 times a second, sensor's axes
    drive.measure_speed(speed_mps, age_us)         # each new value of the speed source, 1 to 10 a second
    if drive.ready: drive.matrix(out)

What to show follows from `state`, `counted` of `needed` and, when REFUSED, from `problem.lcd`. Whether an alignment
that is there already still fits: driving_check.compare(). Fixed memory; each call does a short piece of the work.
"""

from math import atan2, degrees, pi, sqrt

from .braking import BrakingFinder
from .braking_regression import LAG_STEP_US, LAGS, BrakingRegression, Fit
from .driving_reasons import HALVES_DEG, late, moved, not_ready, units
from .force_history import BIN_US, COLUMNS, ForceHistory, difference
from .rotation import angle_deg, cross, dot, norm, normalize, vector
from .speed_check import SpeedCheck
from .standing import StandingVertical

_G = 9.80665
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
MIN_INTERVAL_US = 400_000  # a GPS at 10 Hz says no more than one at 2 Hz, and differences are noisier
MAX_INTERVAL_US = 2_200_000  # one value of a GPS at 1 Hz may be missing
STRAIGHT_DPS = 2.0  # at 10 m/s 0.036 g to the side, a fifth of a braking; the regression takes off most of that
MIN_SPEED_MPS = 1.0  # slower, steering is large and a stop ends with a jerk
MAX_FORCE_G = 3.0  # a mean beyond is a knock
PIECE_US = 12_000  # where samples come slower, more pieces of work are done at each
MEAN_S = 60.0  # of the force, which is the vertical until there is a better one

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


class DriveAlignment:
    """vehicle: CAR or MOTORCYCLE. up: unit vector of the vertical in the sensor's axes, from the two poses, if known
    (motorcycle; without it the vertical comes from straight riding). bias: of the gyro (3, deg/s), to be taken off
    until a stop shows it; zeros for rates that are corrected already. Without it nothing counts before the first stop.

    state; counted: brakings so far, and up to two starts, of needed; brakings, starts: how many of each; turned:
    brakings not counted because of a turn;
    ready; quality_deg: standard error of forward's direction, 180 until there is one; halves_deg: how far two halves
    of the drive disagree about it; lag_s: of the speed; problem: an AlignmentError with reason and lcd, or None;
    standing: a StandingVertical, with the gyro's bias.
    """

    def __init__(self, vehicle, up=None, bias=None):
        self.vehicle = vehicle
        self.standing = StandingVertical()
        self._bias_known = bias is not None
        for i in range(3):
            self.standing.bias[i] = bias[i] if bias else 0.0
        self.needed = NEEDED
        self.brakings = self.starts = self.turned = 0
        self._good = False
        self.quality_deg = self.halves_deg = 180.0
        self.lag_s = 0.0
        self.top_mps = 0.0
        self.fit = Fit()
        self.regression = BrakingRegression()
        self.lag = 0
        self._up = vector(up[0], up[1], up[2]) if up is not None else None
        self._mean = None
        self._mean_s = 0.0
        self._finder = BrakingFinder(LAGS)
        self._judged_stops = 0
        self._speed_check = SpeedCheck()
        self._history = ForceHistory()
        self.speed_problem = self._mount_problem = None
        self._part = Fit()
        self._sums = [0.0] * 6
        self._sums_us = 0
        self._second = [0.0] * 3
        self._second_us = 0
        self._ends = [[0] * COLUMNS for _ in range(LAGS)]
        self._end = [0] * COLUMNS
        self._known = [False] * LAGS
        self._speed = -1.0  # none yet
        self._quiet_us = 0  # since the last value
        self._before = (0.0, 0)  # speed and time at the end of the last interval
        self._next = None  # likewise, of the one to be worked on
        self._work = None
        self._straight = [False] * LAGS

    @property
    def counted(self):
        """How much of what is needed is there: each braking, and up to two straight starts."""
        return self.brakings + min(self.starts, MAX_STARTS)

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
        if not self._finder.going_on or self._finder.change > 0.0:
            return DRIVE
        return BRAKING if self._straight[self.lag] else TURNING

    @property
    def ready(self):
        """True while matrix() can be taken."""
        return self._good and self.problem is None

    @property
    def problem(self):
        """What is wrong with speed or mount: an AlignmentError, or None."""
        if self._speed_check.problem is None and self.standing.moved and self.vehicle == CAR:
            return moved("two stops differ by over %.0f degrees" % LEVEL_DEG)
        return self._speed_check.problem or self._mount_problem or self.speed_problem

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
            if self._work is not None:
                if next(self._work, True):
                    self._work = None
            elif self._next is not None and difference(self._history.now, self._next[1]) >= 0:
                self._begin_work()

    def finish(self):
        """No more samples will come: do at once what work is left."""
        while self._work is not None:
            if next(self._work, True):
                self._work = None

    def measure_speed(self, speed_mps, age_us=0):
        """A new value of the speed source. age_us: how old it is known to be; an unknown lag is found by itself."""
        self._speed_check.measure(speed_mps)
        if not speed_mps >= 0.0:
            speed_mps = 0.0
        self._speed = speed_mps
        self._quiet_us = 0
        self.top_mps = max(self.top_mps, speed_mps)
        time_us = self._history.now + self._sums_us - age_us
        if self._next is None and difference(time_us, self._before[1]) >= MIN_INTERVAL_US:
            self._next = (speed_mps, time_us)

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
            size = norm(fit.level)
            best = [self.standing.up[i] + fit.level[i] / size for i in range(3)]
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
        self.vertical(up, self.fit)
        cross(left, up, self.fit.forward)
        normalize(left)
        cross(forward, left, up)
        for i in range(3):
            out[i] = left[i]
            out[3 + i] = up[i]
            out[6 + i] = forward[i]

    def _interrupt(self):
        """Samples are missing: what follows does not join what came before."""
        self._sums = [0.0] * 6
        self._sums_us = 0
        self._history.clear()
        self._work = self._next = None
        self._before = (0.0, self._history.now - MIN_INTERVAL_US)
        self._known = [False] * LAGS
        self._finder.interrupt()

    def _end_bin(self):
        sums, n = self._sums, self._sums_us
        seconds = n * 1e-6
        force = [sums[0] / n, sums[1] / n, sums[2] / n]
        rate = [sums[3] / n, sums[4] / n, sums[5] / n]
        if self._mean is None:
            self._mean = vector()
        self._mean_s = min(MEAN_S, self._mean_s + seconds)
        gain = seconds / self._mean_s
        for i in range(3):
            self._mean[i] += gain * (force[i] - self._mean[i])
        if self._speed >= 0.0:
            self.standing.update(force, rate, self._speed, seconds)
        up = self.standing.up if self.standing.stops and self.vehicle == CAR else self._up or self._mean
        bias = self.standing.bias
        turned = (rate[0] - bias[0]) * up[0] + (rate[1] - bias[1]) * up[1] + (rate[2] - bias[2]) * up[2]
        self._history.add(sums, turned * seconds * 1e5, n)
        self._seconds(force, n)
        self._quiet_us = min(STALE_US + 1, self._quiet_us + n)
        self._sums_us = 0
        for i in range(6):
            sums[i] = 0.0

    def _seconds(self, force, n):
        """Means of a second each, for the check of the speed."""
        for i in range(3):
            self._second[i] += force[i] * n
        self._second_us += n
        if self._second_us >= 1_000_000:
            self._speed_check.second([total / self._second_us for total in self._second])
            self._second_us = 0
            for i in range(3):
                self._second[i] = 0.0

    def _begin_work(self):
        speed, time_us = self._next
        before_speed, before_us = self._before
        self._before = self._next
        self._next = None
        length_us = difference(time_us, before_us)
        if length_us > MAX_INTERVAL_US:
            self._known = [False] * LAGS
            self._finder.interrupt()
        self._work = self._follow(time_us, length_us * 1e-6, before_speed, speed)

    def _follow(self, time_us, seconds, before, speed):
        """Lay the change of speed beside what was felt, at each lag; a generator of short pieces."""
        mean = 0.5 * (before + speed)
        change = speed - before
        straight = self._straight
        counts = mean > MIN_SPEED_MPS and (self._bias_known or self.standing.stops)
        force = [0.0] * 3
        end = self._end
        for lag in range(LAGS):
            known = self._history.at(end, time_us - lag * LAG_STEP_US)
            begin = self._ends[lag]
            straight[lag] = False
            if known and self._known[lag] and counts:
                for i in range(3):
                    force[i] = difference(end[i], begin[i]) * 1e-6
                yaw_dps = difference(end[3], begin[3]) * 1e-5 / seconds
                straight[lag] = abs(yaw_dps) <= STRAIGHT_DPS
                if straight[lag] and norm(force) < MAX_FORCE_G * seconds:
                    curve_g = mean * yaw_dps * (pi / 180.0 / _G)
                    self.regression.add(lag, seconds, change / _G, curve_g, force)
            for i in range(COLUMNS):
                begin[i] = end[i]
            self._known[lag] = known
            yield
        events = self.brakings + self.starts
        if self._finder.update(change, seconds, straight):
            yield from self._count()
        if self.brakings + self.starts != events or self.standing.stops != self._judged_stops:
            self._judged_stops = self.standing.stops
            yield from self._judge()
        yield True

    def _count(self):
        """A braking or a start has ended: which lag fits best by now, and was it straight? A generator of short
        pieces."""
        part = self._part
        explained = [0.0] * LAGS
        for lag in range(LAGS):
            if (yield from self.regression.fitting(part, lag)):
                explained[lag] = part.explained
        self.lag = best = explained.index(max(explained))
        self.lag_s = (best + _peak(explained, best)) * LAG_STEP_US * 1e-6
        braked = self._finder.change < 0.0
        if not self._finder.was_straight(best):
            if braked:
                self.turned += 1
            return
        if braked:
            self.brakings += 1
        else:
            self.starts += 1
        yield from self.regression.close_block()

    def _judge(self):
        """How good is it, ready or not? A generator of short pieces."""
        regression, part, best = self.regression, self._part, self.lag
        up = vector()
        if not (yield from regression.fitting(self.fit, best)):
            return
        if not self.vertical(up, self.fit):
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
            if not (yield from regression.fitting(part, best, block, block + 1)):
                continue
            x, y, weight = dot(left, part.forward), dot(forward, part.forward), part.weight
            yield
            slope = sqrt(x * x + y * y)
            slopes += weight * slope
            weights += weight
            if blocks > 1 and (yield from regression.fitting(part, best, 0, blocks, block)):
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
        if (yield from regression.fitting(part, best, 0, half)):
            one = atan2(dot(left, part.forward), dot(forward, part.forward))
            level = vector(part.level[0], part.level[1], part.level[2])
            yield
            if (yield from regression.fitting(part, best, half, blocks)):
                two = atan2(dot(left, part.forward), dot(forward, part.forward))
                self.halves_deg = degrees(_apart(one, two))
                self._decide(slopes / weights, angle_deg(level, part.level), outlier_deg)

    def _decide(self, slope, level_deg, outlier_deg):
        """slope: force per change of speed; level_deg: between the verticals of two halves of the drive; outlier_deg:
        of one block's forward from that of all others."""
        self.speed_problem = self._mount_problem = None
        if self.counted >= self.needed:
            before = self.standing.up if self.vehicle == CAR else self._up
            from_driving = 0.0 if before is None else angle_deg(before, self.fit.level)
            if level_deg > LEVEL_DEG:
                self._mount_problem = moved("the vertical changed by %.0f degrees during the drive" % level_deg)
            elif from_driving > LEVEL_DEG:
                what = "standing" if self.vehicle == CAR else "the upright pose"
                self._mount_problem = moved("%s and driving differ by %.0f degrees" % (what, from_driving))
            elif outlier_deg > OUTLIER_DEG:
                self._mount_problem = moved("forward is no longer where it was")
        if self.counted >= CHECKED:
            if self.lag_s >= MAX_LATE_S:
                self.speed_problem = late(self.lag_s)
            elif not MIN_SLOPE < slope < MAX_SLOPE:
                self.speed_problem = units(slope)
        self._good = (
            self.counted >= self.needed
            and self.halves_deg <= (HALVES_STAY_DEG if self._good else HALVES_DEG)
            and self.quality_deg <= (READY_STAY_DEG if self._good else READY_DEG)
        )


def _apart(a, b):
    """Angle between two directions, 0 to pi."""
    between = abs(a - b)
    return min(between, 2 * pi - between)


def _peak(values, i):
    """Where between the neighbours of i, its largest value, the peak is: -0.5 to 0.5."""
    if i == 0 or i == len(values) - 1:
        return 0.0
    before, at, after = values[i - 1], values[i], values[i + 1]
    bend = before - 2.0 * at + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 0.0
