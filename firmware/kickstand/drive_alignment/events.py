"""Finds braking and acceleration events, decides which of them were in a straight line, and computes forward from them.

ForceHistory keeps force and yaw rate of the last seconds, because a speed arrives late and must be compared with
earlier readings. The lag of the speed is unknown. So each change of speed is compared with force and yaw rate once for
each possible lag.

ForwardRegression computes forward by a regression of the force on dv/dt while driving straight:

    f = level + forward a + left c        a = dv/dt / g, c = v (yaw rate) / g

All vectors are in the sensor's own axes, and each interval is weighted by its length. The intercept, `level`, is the
vertical of straight driving. `level` is fitted together with `forward`, so an error of the vertical does not affect
`forward`. The term of c absorbs the lateral force of slight bends. A motorcycle leans into bends, so its coefficient of
c is about zero. The length of `forward` is 1 if the speed source sends m/s, and 1/3.6 if it sends km/h. With the right
lag the regression explains the largest part of the force.

A regression block has the sums of a few events (braking or acceleration), so that parts of the drive can be compared.
When all blocks are in use, they are joined in pairs, so memory is fixed. From then on at least half of the blocks are
always in use.
"""

from array import array
from math import atan2, pi

from ..calibration.vectors import dot, norm
from ..units import STANDARD_GRAVITY, const

BIN_US = 100_000
SIZE = 64  # number of bins, enough for the lag of a speed, the interval before the speed, and the time to process them
MASK = 0x1FFFFFFF
_HALF = 0x10000000
COLUMNS = 4  # three integrals of the force in 1e-6 g s, and one integral of the yaw rate in 1e-5 degrees


def difference(a, b):
    """Return a - b for values that wrap."""
    return ((a - b + _HALF) & MASK) - _HALF


class ForceHistory:
    """A ring of running integrals of force and yaw rate, with one entry for the end of each bin.

    The integrals are integers that wrap. The difference of two integers stays exact in a long drive, while float32 sums
    lose digits as they grow. Integers also need no heap.

    Attributes:
        now: the time at the end of the newest bin in us. This time is the sum of all bins' lengths, and wraps at MASK.
    """

    def __init__(self):
        self._times = array("i", [0] * SIZE)
        self._columns = [array("i", [0] * SIZE) for _ in range(COLUMNS)]
        self._total = [0] * COLUMNS
        self._newest = 0
        self._count = 1  # number of entries that can be looked up
        self.now = 0

    def clear(self):
        """Drop all entries, because samples are missing. A difference of integrals must not span the gap."""
        self._count = 1

    def add(self, force_us, yaw, dt_us):
        """Add a bin.

        Args:
            force_us: integral of the force over the bin, 3 values in g us.
            yaw: integral of the yaw rate over the bin, in 1e-5 degrees.
            dt_us: length of the bin.
        """
        self.now = (self.now + dt_us) & MASK
        self._newest = newest = (self._newest + 1) % SIZE
        self._times[newest] = self.now
        for k in range(COLUMNS):
            self._total[k] = total = (self._total[k] + round(force_us[k] if k < 3 else yaw)) & MASK
            self._columns[k][newest] = total
        self._count = min(SIZE, self._count + 1)

    def at(self, out, time_us):
        """Look up the integrals at a time, interpolated within its bin.

        Args:
            out: list of COLUMNS integers for the integrals.
            time_us: the time on the clock of `now`.

        Returns:
            False if the time is not in the history.
        """
        behind = difference(self.now, time_us)
        if behind < 0 or behind >= difference(self.now, self._times[(self._newest - self._count + 1) % SIZE]):
            return False
        # A bin may be longer than BIN_US, but hardly twice as long. So start the search half as many bins back as bins
        # of BIN_US would need.
        i = self._newest
        step = behind // (2 * BIN_US)
        if step < self._count:
            i = (i - step) % SIZE
            if difference(self._times[i], time_us) < 0:
                i = self._newest
        previous = (i - 1) % SIZE
        while difference(self._times[previous], time_us) > 0:
            i = previous
            previous = (i - 1) % SIZE
        begin = self._times[previous]
        share = difference(time_us, begin) / difference(self._times[i], begin)
        for k in range(COLUMNS):
            column = self._columns[k]
            start = column[previous]
            out[k] = (start + round(share * difference(column[i], start))) & MASK
        return True


BLOCKS = 8
LAG_STEP_US = 250_000  # difference between two successive lags
LAGS = 11  # number of lags, from 0 to 2.5 s
# Indices of the sums of one regression block: the time in s, and the integrals of a, c, a a, a c, c c, f, a f and c f
# over this time. The last three integrals have 3 values each.
_TERMS = const(15)
SECONDS, A, C, AA, AC, CC, F, AF, CF = 0, 1, 2, 3, 4, 5, 6, 9, 12
_RIDGE = const(1e-6)  # ridge term in g^2, which keeps the coefficient of c at zero if the drive had no bend


class Fit:
    """A result of the regression.

    Attributes:
        forward: 3 values in g per g.
        level: 3 values in g.
        weight: variation of the change of speed in g^2 s. The weight measures the information about forward.
        seconds: duration of the straight driving.
        explained: the part of the force's variation that forward explains, in g^2 s.
        found: False if there was nothing to fit.
    """

    def __init__(self):
        self.forward = [0.0] * 3
        self.level = [0.0] * 3
        self.weight = self.seconds = self.explained = 0.0
        self.found = False
        self.total = [0.0] * _TERMS  # each Fit has its own sums, because two Fits may be computed at the same time

    def angle(self, left, forward):
        """Return the angle of this fit's forward from a forward direction to the left, in rad."""
        return atan2(dot(left, self.forward), dot(forward, self.forward))


class ForwardRegression:
    """The regression of a drive.

    Attributes:
        blocks: number of regression blocks in use. The last block is still being filled.
    """

    def __init__(self):
        self._sums = [array("f", [0.0] * (BLOCKS * _TERMS)) for _ in range(LAGS)]
        self._events_per_block = 1
        self._events_in_last = 0
        self.blocks = 1

    def add(self, lag, seconds, change_g, curve_g, force):
        """Add one interval for one lag.

        Args:
            lag: index of the lag.
            seconds: length of the interval.
            change_g: change of speed in the interval, in g s.
            curve_g: mean of c in the interval, in g.
            force: integral of the force over the interval, 3 values in g s.
        """
        sums = self._sums[lag]
        k = (self.blocks - 1) * _TERMS
        a = change_g / seconds
        sums[k] += seconds
        sums[k + A] += change_g
        sums[k + C] += curve_g * seconds
        sums[k + AA] += a * change_g
        sums[k + AC] += change_g * curve_g
        sums[k + CC] += curve_g * curve_g * seconds
        for i in range(3):
            f = force[i]
            sums[k + F + i] += f
            sums[k + AF + i] += a * f
            sums[k + CF + i] += curve_g * f

    def end_event(self):
        """After an event, begin the next block if the current block is full. A generator of short steps."""
        self._events_in_last += 1
        if self._events_in_last < self._events_per_block:
            return
        self._events_in_last = 0
        if self.blocks < BLOCKS:
            self.blocks += 1
            return
        for sums in self._sums:
            for block in range(BLOCKS):
                to, source = block * _TERMS, 2 * block * _TERMS
                for k in range(_TERMS):
                    sums[to + k] = sums[source + k] + sums[source + _TERMS + k] if 2 * block < BLOCKS else 0.0
                yield
        self._events_per_block *= 2
        self.blocks = BLOCKS // 2 + 1

    @property
    def filled(self):
        """The number of blocks with at least one complete event."""
        return self.blocks if self._events_in_last else self.blocks - 1

    def fit(self, out, lag, first=0, last=BLOCKS):
        """Fit the blocks from first to last - 1 at once. Return False if there is nothing to fit.

        Args:
            out: the Fit for the result.
            lag: index of the lag.
            first, last: the range of the blocks.
        """
        for _ in self.fitting(out, lag, first, last):
            pass
        return out.found

    def fitting(self, out, lag, first=0, last=BLOCKS, without=-1):
        """Do the same as fit(), as a generator of short steps. The generator returns True or False.

        Args:
            without: index of a block to leave out, or -1.
        """
        sums, total = self._sums[lag], out.total
        out.found = False
        for k in range(_TERMS):
            total[k] = 0.0
        gathered = 0
        for block in range(first, min(last, self.blocks)):
            if block != without:
                start = block * _TERMS
                for k in range(_TERMS):
                    total[k] += sums[start + k]
                gathered += 1
                if gathered % 3 == 0:
                    yield
        if gathered % 3:
            yield
        n = total[SECONDS]
        if n <= 0.0:
            return False
        # the normal equations, with the means of a and c removed
        a, c = total[A] / n, total[C] / n
        aa = total[AA] - n * a * a
        cc = total[CC] - n * c * c + _RIDGE * n
        ac = total[AC] - n * a * c
        determinant = aa * cc - ac * ac
        if determinant <= 1e-6 * aa * cc:
            return False
        out.seconds = n
        out.weight = aa - ac * ac / cc
        out.explained = 0.0
        for i in range(3):
            f = total[F + i]
            af = total[AF + i] - a * f
            cf = total[CF + i] - c * f
            forward = (af * cc - cf * ac) / determinant
            left = (cf * aa - af * ac) / determinant
            out.forward[i] = forward
            out.level[i] = f / n - a * forward - c * left
            out.explained += forward * forward * out.weight
        out.found = True
        return True


# An event begins when the absolute acceleration exceeds BEGIN_MPS2, and ends when it falls below END_MPS2. An event
# must change the speed by at least _CHANGE_MPS.
BEGIN_MPS2, END_MPS2 = 0.8, 0.4
_CHANGE_MPS = const(1.5)
_MAX_ACCELERATION_EVENTS = const(2)  # further acceleration events do not count, because braking shows forward better
# Shortest interval between two speeds. In a shorter interval the change of speed is noisier, and speeds at 10 Hz do not
# carry more information than at 2 Hz.
MIN_INTERVAL_US = 400_000
MAX_INTERVAL_US = 2_200_000  # longest interval; it allows one missing value of a GPS at 1 Hz
_MAX_WAITING = const(4)  # number of intervals that can wait while an earlier interval is processed
# Largest yaw rate of straight driving. At 10 m/s a yaw rate of 2 deg/s causes a lateral force of 0.036 g, a fifth of
# the force of braking. The regression removes most of this lateral force.
_STRAIGHT_DPS = const(2.0)
# Lowest mean speed of an interval that is used. At lower speeds steering angles are large, and a stop ends with a jerk.
_MIN_SPEED_MPS = const(1.0)
_MAX_FORCE_G = const(3.0)  # largest mean force of an interval that is used; a larger force means a knock on the sensor


class EventFinder:
    """Finds braking and acceleration events from the speed alone.

    Args:
        lags: number of possible lags of the speed.

    Attributes:
        going_on: True during an event.
        change: the change of speed in the current event or, between events, in the last event. The change is in m/s,
            and negative for braking.
    """

    def __init__(self, lags):
        self._straight_change = [0.0] * lags  # for each lag, the change of speed while driving straight
        self.interrupt()

    def interrupt(self):
        """Drop the current event, because speeds are missing."""
        self.going_on = False
        self.change = 0.0
        for lag in range(len(self._straight_change)):
            self._straight_change[lag] = 0.0

    def update(self, change_mps, seconds, straight):
        """Add one interval with its change of speed.

        Args:
            change_mps: the change of speed in m/s.
            seconds: length of the interval.
            straight: for each lag, True if the vehicle drove straight in the interval.

        Returns:
            True if an event has just ended.
        """
        acceleration = change_mps / seconds
        if self.going_on and (acceleration if self.change > 0.0 else -acceleration) < END_MPS2:
            self.going_on = False
            if abs(self.change) >= _CHANGE_MPS:
                return True
        if not self.going_on and abs(acceleration) > BEGIN_MPS2:
            self.interrupt()
            self.going_on = True
        if self.going_on:
            self.change += change_mps
            for lag in range(len(straight)):
                if straight[lag]:
                    self._straight_change[lag] += change_mps
        return False

    def was_straight(self, lag):
        """Return True if the change of speed while driving straight was large enough for an event."""
        return abs(self._straight_change[lag]) >= _CHANGE_MPS


class LastEvent:
    """Estimates forward from the latest event and the vertical. The estimate is immediate, but exact only to about 10
    degrees."""

    def __init__(self):
        self._force = [0.0] * 3
        self.clear()

    def clear(self):
        """Drop the sums, because a new event begins."""
        self._weight = self._change = 0.0
        for i in range(3):
            self._force[i] = 0.0

    def add(self, seconds, change_g, force):
        """Add a straight interval of the event. The arguments are those of ForwardRegression.add()."""
        a = change_g / seconds
        self._weight += a * change_g
        self._change += change_g
        for i in range(3):
            self._force[i] += a * force[i]

    def forward(self, out, level):
        """Estimate forward.

        Args:
            out: list of 3 for forward, in g per g.
            level: the vertical, 3 values in g.

        Returns:
            The weight of the estimate, in g^2 s.
        """
        for i in range(3):
            out[i] = (self._force[i] - self._change * level[i]) / max(self._weight, 1e-6)
        return self._weight


class DrivingEvents:
    """The events of a drive.

    Args:
        history: the ForceHistory of the same drive.

    Attributes:
        braking_count: number of straight braking events so far.
        acceleration_count: number of straight acceleration events so far.
        turning_count: number of braking events that were not straight.
        lag_s: lag of the speed, in seconds.
        lag: index of the regression's lag that is nearest to lag_s.
        regression: the ForwardRegression of all straight driving.
        last: the LastEvent.
    """

    def __init__(self, history):
        self.braking_count = self.acceleration_count = self.turning_count = 0
        self.lag = 0
        self.lag_s = 0.0
        self.regression = ForwardRegression()
        self.last = LastEvent()
        self._history = history
        self._finder = EventFinder(LAGS)
        self._fit = Fit()
        # The next three lists describe the last interval between two speeds. Each list has one entry per lag.
        self._ends = [[0] * COLUMNS for _ in range(LAGS)]  # the history's integrals at the end of the interval
        self._known = [False] * LAGS  # True if the integrals at the end of the interval were known
        self._straight = [False] * LAGS  # True if the vehicle drove straight in the interval
        self._end = [0] * COLUMNS
        self._before = (0.0, 0)  # speed and time at the end of the last interval
        self._waiting = []  # speed and time at the end of each interval that is not processed yet

    @property
    def straight_count(self):
        """The number of all straight events."""
        return self.braking_count + self.acceleration_count

    @property
    def counted(self):
        """The number of events that count for an alignment: all straight braking events, and at most
        _MAX_ACCELERATION_EVENTS straight acceleration events."""
        return self.braking_count + min(self.acceleration_count, _MAX_ACCELERATION_EVENTS)

    @property
    def braking(self):
        """True during a braking event."""
        return self._finder.going_on and self._finder.change < 0.0

    @property
    def straight(self):
        """True if the vehicle drove straight in the last interval."""
        return self._straight[self.lag]

    def interrupt(self):
        """Drop the current event and the waiting intervals, because samples are missing. Counted events are kept."""
        self._waiting.clear()
        self._before = (0.0, self._history.now - MIN_INTERVAL_US)
        self._forget_interval()

    def _forget_interval(self):
        for lag in range(LAGS):
            self._known[lag] = False
        self._finder.interrupt()

    def measure_speed(self, speed_mps, time_us):
        """Take a new speed and its time on the history's clock."""
        previous = self._waiting[-1] if self._waiting else self._before
        if len(self._waiting) < _MAX_WAITING and difference(time_us, previous[1]) >= MIN_INTERVAL_US:
            self._waiting.append((speed_mps, time_us))

    @property
    def due(self):
        """True if the history has reached the end of a waiting interval."""
        return bool(self._waiting) and difference(self._history.now, self._waiting[0][1]) >= 0

    def follow(self, use):
        """Process the next interval, as a generator of short steps.

        Args:
            use: True if the gyro's bias is known. If not, the interval is not used, because straight driving and bends
                cannot be distinguished.
        """
        begin_mps, begin_us = self._before
        speed, time_us = self._before = self._waiting.pop(0)
        length_us = difference(time_us, begin_us)
        if length_us > MAX_INTERVAL_US:
            self._forget_interval()
        seconds = length_us * 1e-6
        mean = 0.5 * (begin_mps + speed)
        change = speed - begin_mps
        change_g = change / STANDARD_GRAVITY
        use = use and mean > _MIN_SPEED_MPS
        straight = self._straight
        force, best_force = [0.0] * 3, None
        end = self._end
        for lag in range(LAGS):
            valid = self._history.at(end, time_us - lag * LAG_STEP_US)
            begin = self._ends[lag]
            straight[lag] = False
            if valid and self._known[lag] and use:
                for i in range(3):
                    force[i] = difference(end[i], begin[i]) * 1e-6
                yaw_dps = difference(end[3], begin[3]) * 1e-5 / seconds
                straight[lag] = abs(yaw_dps) <= _STRAIGHT_DPS
                if lag == self.lag:
                    best_force = list(force)
                if straight[lag] and norm(force) < _MAX_FORCE_G * seconds:
                    curve_g = mean * yaw_dps * (pi / 180.0 / STANDARD_GRAVITY)
                    self.regression.add(lag, seconds, change_g, curve_g, force)
            for i in range(COLUMNS):
                begin[i] = end[i]
            self._known[lag] = valid
            yield
        if self._finder.update(change, seconds, straight):
            yield from self._end_event()
        elif self._finder.going_on:
            if self._finder.change == change:  # this interval is the first of an event
                self.last.clear()
            if straight[self.lag]:
                self.last.add(seconds, change_g, best_force)

    def _end_event(self):
        """Find the best lag after an event has ended, and count the event if it was straight."""
        fit = self._fit
        explained = [0.0] * LAGS
        for lag in range(LAGS):
            if (yield from self.regression.fitting(fit, lag)):
                explained[lag] = fit.explained
        yield
        self.lag = best = explained.index(max(explained))
        self.lag_s = (best + _peak(explained, best)) * LAG_STEP_US * 1e-6
        braked = self._finder.change < 0.0
        if not self._finder.was_straight(best):
            if braked:
                self.turning_count += 1
            return
        if braked:
            self.braking_count += 1
        else:
            self.acceleration_count += 1
        yield from self.regression.end_event()


def _peak(values, i):
    """Return the position of the peak of the parabola through values[i] and its two neighbours, relative to i.

    values[i] must be the largest value. The result is from -0.5 to 0.5."""
    if i == 0 or i == len(values) - 1:
        return 0.0
    lower, peak, upper = values[i - 1], values[i], values[i + 1]
    bend = lower - 2.0 * peak + upper
    return 0.5 * (lower - upper) / bend if bend < 0.0 else 0.0
