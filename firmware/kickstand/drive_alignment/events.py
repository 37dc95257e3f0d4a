"""Brakings and starts, and which of them were in a straight line: each change of speed laid beside what was felt."""

from math import pi

from ..rotation import norm
from .braking import BrakingFinder
from .history import COLUMNS, difference
from .regression import LAG_STEP_US, LAGS, BrakingRegression, Fit

_G = 9.80665
MIN_INTERVAL_US = 400_000  # a GPS at 10 Hz says no more than one at 2 Hz, and differences are noisier
WAITING = 4  # intervals, while others are judged
MAX_INTERVAL_US = 2_200_000  # one value of a GPS at 1 Hz may be missing
STRAIGHT_DPS = 2.0  # at 10 m/s 0.036 g to the side, a fifth of a braking; the regression takes off most of that
MIN_SPEED_MPS = 1.0  # slower, steering is large and a stop ends with a jerk
MAX_FORCE_G = 3.0  # a mean beyond is a knock


class OneEvent:
    """Forward from one event, against a vertical that is known: good to some 10 degrees, but at once."""

    def __init__(self):
        self._force = [0.0] * 3
        self.clear()

    def clear(self):
        """The next one begins."""
        self._weight = self._change = 0.0
        for i in range(3):
            self._force[i] = 0.0

    def add(self, seconds, change_g, force):
        """An interval of it, in a straight line: as BrakingRegression.add()."""
        a = change_g / seconds
        self._weight += a * change_g
        self._change += change_g
        for i in range(3):
            self._force[i] += a * force[i]

    def forward(self, out, level):
        """Fill out (3, g per g). Returns its weight (g^2 s)."""
        for i in range(3):
            out[i] = (self._force[i] - self._change * level[i]) / max(self._weight, 1e-6)
        return self._weight


class DrivingEvents:
    """history: the ForceHistory of the same time.

    brakings, starts: those in a straight line; turned: brakings that were not; lag_s: of the speed, and lag the nearest
    of the regression's; regression: of all straight driving.
    """

    def __init__(self, history):
        self.brakings = self.starts = self.turned = 0
        self.lag = 0
        self.lag_s = 0.0
        self.regression = BrakingRegression()
        self.last = OneEvent()
        self._history = history
        self._finder = BrakingFinder(LAGS)
        self._part = Fit()
        self._ends = [[0] * COLUMNS for _ in range(LAGS)]
        self._end = [0] * COLUMNS
        self._known = [False] * LAGS
        self._straight = [False] * LAGS
        self._before = (0.0, 0)  # speed and time at the end of the last interval
        self._next = []  # likewise, of those to be worked on

    @property
    def count(self):
        """All that were straight."""
        return self.brakings + self.starts

    @property
    def braking(self):
        """True while one goes on."""
        return self._finder.going_on and self._finder.change < 0.0

    @property
    def straight(self):
        """True if the vehicle did not turn in the last interval."""
        return self._straight[self.lag]

    def interrupt(self):
        """Samples are missing: what follows does not join what came before."""
        self._next.clear()
        self._before = (0.0, self._history.now - MIN_INTERVAL_US)
        self._disjoin()

    def _disjoin(self):
        for lag in range(LAGS):
            self._known[lag] = False
        self._finder.interrupt()

    def measure_speed(self, speed_mps, time_us):
        """A new speed, and when it was."""
        before = self._next[-1] if self._next else self._before
        if len(self._next) < WAITING and difference(time_us, before[1]) >= MIN_INTERVAL_US:
            self._next.append((speed_mps, time_us))

    @property
    def due(self):
        """True if there is an interval to follow() and all that was felt in it is there."""
        return bool(self._next) and difference(self._history.now, self._next[0][1]) >= 0

    def follow(self, counts):
        """Work on the interval that is due; a generator of short pieces. counts: straight driving may be used."""
        before, before_us = self._before
        speed, time_us = self._before = self._next.pop(0)
        length_us = difference(time_us, before_us)
        if length_us > MAX_INTERVAL_US:
            self._disjoin()
        seconds = length_us * 1e-6
        mean = 0.5 * (before + speed)
        change = speed - before
        counts = counts and mean > MIN_SPEED_MPS
        straight = self._straight
        force = felt = [0.0] * 3
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
                if lag == self.lag:
                    felt = list(force)
                if straight[lag] and norm(force) < MAX_FORCE_G * seconds:
                    curve_g = mean * yaw_dps * (pi / 180.0 / _G)
                    self.regression.add(lag, seconds, change / _G, curve_g, force)
            for i in range(COLUMNS):
                begin[i] = end[i]
            self._known[lag] = known
            yield
        if self._finder.update(change, seconds, straight):
            yield from self._count()
        elif self._finder.going_on:
            if self._finder.change == change:
                self.last.clear()
            if straight[self.lag]:
                self.last.add(seconds, change / _G, felt)

    def _count(self):
        """A braking or a start has ended: which lag fits best by now, and was it straight?"""
        part = self._part
        explained = [0.0] * LAGS
        for lag in range(LAGS):
            if (yield from self.regression.fitting(part, lag)):
                explained[lag] = part.explained
        yield
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


def _peak(values, i):
    """Where between the neighbours of i, its largest value, the peak is: -0.5 to 0.5."""
    if i == 0 or i == len(values) - 1:
        return 0.0
    before, at, after = values[i - 1], values[i], values[i + 1]
    bend = before - 2.0 * at + after
    return 0.5 * (before - after) / bend if bend < 0.0 else 0.0
