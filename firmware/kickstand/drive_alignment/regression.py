"""Computes forward by a regression of the force on dv/dt while driving straight, for several lags of the speed at once.

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

from ..units import const

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
