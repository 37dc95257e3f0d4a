"""Finds braking and acceleration events, and decides which of them were in a straight line.

The lag of the speed is unknown. So each change of speed is compared with force and yaw rate once for each possible lag.
"""

from math import pi

from ..rotation import norm
from ..units import STANDARD_GRAVITY, const
from .history import COLUMNS, difference
from .regression import LAG_STEP_US, LAGS, Fit, ForwardRegression

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
