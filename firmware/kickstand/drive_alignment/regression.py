"""Forward from driving straight: force regressed on dv/dt, for several lags of the speed at once.

    f = level + forward a + left c        a = dv/dt / g, c = v (yaw rate) / g

in the sensor's own axes, each sum weighted by time. The intercept, level, takes up what a tilt of the vertical would
leak sideways; c takes up what is left of curves. On a motorcycle, which leans into them, its coefficient is about zero.
|forward| is 1 if the speed is in m/s, 1/3.6 if it is in km/h. At the right lag the regression explains most.

The sums of each few brakings stand in a block of their own, so that parts of the drive can be compared. When all blocks
are in use, each two are joined: fixed memory, and never fewer than half of the blocks.
"""

from array import array

BLOCKS = 8
LAG_STEP_US = 250_000
LAGS = 11
TERMS = 15
SECONDS, A, C, AA, AC, CC, S, AS, CS = 0, 1, 2, 3, 4, 5, 6, 9, 12  # S, AS, CS: three each
RIDGE = 1e-6  # g^2: no curve at all leaves the coefficient of c at zero


class Fit:
    """forward (3, g per g), level (3, g); weight: how much the speed changed (g^2 s); seconds: of all; explained: what
    forward explains of the force (g^2 s); found: False if there was nothing to fit."""

    def __init__(self):
        self.forward = [0.0] * 3
        self.level = [0.0] * 3
        self.weight = self.seconds = self.explained = 0.0
        self.found = False
        self.total = [0.0] * TERMS  # of its own: one Fit may be made in the middle of another


class BrakingRegression:
    """blocks: in use, the last of them still filling up."""

    def __init__(self):
        self._sums = [array("f", [0.0] * (BLOCKS * TERMS)) for _ in range(LAGS)]
        self._per_block = 1
        self._in_last = 0
        self.blocks = 1

    def add(self, lag, seconds, change_g, curve_g, force):
        """seconds: length of the interval; change_g: of the speed over it, in g s; curve_g: c; force: its integral
        (3, g s)."""
        sums = self._sums[lag]
        k = (self.blocks - 1) * TERMS
        a = change_g / seconds
        sums[k] += seconds
        sums[k + A] += change_g
        sums[k + C] += curve_g * seconds
        sums[k + AA] += a * change_g
        sums[k + AC] += change_g * curve_g
        sums[k + CC] += curve_g * curve_g * seconds
        for i in range(3):
            f = force[i]
            sums[k + S + i] += f
            sums[k + AS + i] += a * f
            sums[k + CS + i] += curve_g * f

    def close_block(self):
        """A braking has ended: begin the next block if this one has its share. A generator of short pieces."""
        self._in_last += 1
        if self._in_last < self._per_block:
            return
        self._in_last = 0
        if self.blocks < BLOCKS:
            self.blocks += 1
            return
        for sums in self._sums:
            for block in range(BLOCKS):
                to, source = block * TERMS, 2 * block * TERMS
                for k in range(TERMS):
                    sums[to + k] = sums[source + k] + sums[source + TERMS + k] if 2 * block < BLOCKS else 0.0
                yield
        self._per_block *= 2
        self.blocks = BLOCKS // 2 + 1

    @property
    def filled(self):
        """Blocks that have at least one braking."""
        return self.blocks if self._in_last else self.blocks - 1

    def fit(self, out, lag, first=0, last=BLOCKS):
        """Fit blocks first to last - 1 into out (Fit), at once. False if there is nothing to fit."""
        for _ in self.fitting(out, lag, first, last):
            pass
        return out.found

    def fitting(self, out, lag, first=0, last=BLOCKS, without=-1):
        """The same, but for one block, as a generator of short pieces that returns True or False."""
        sums, total = self._sums[lag], out.total
        out.found = False
        for k in range(TERMS):
            total[k] = 0.0
        gathered = 0
        for block in range(first, min(last, self.blocks)):
            if block != without:
                start = block * TERMS
                for k in range(TERMS):
                    total[k] += sums[start + k]
                gathered += 1
                if gathered % 3 == 0:
                    yield
        if gathered % 3:
            yield
        n = total[SECONDS]
        if n <= 0.0:
            return False
        a, c = total[A] / n, total[C] / n
        aa = total[AA] - n * a * a
        cc = total[CC] - n * c * c + RIDGE * n
        ac = total[AC] - n * a * c
        determinant = aa * cc - ac * ac
        if determinant <= 1e-6 * aa * cc:
            return False
        out.seconds = n
        out.weight = aa - ac * ac / cc
        out.explained = 0.0
        for i in range(3):
            s = total[S + i]
            along_a = total[AS + i] - a * s
            along_c = total[CS + i] - c * s
            forward = (along_a * cc - along_c * ac) / determinant
            left = (along_c * aa - along_a * ac) / determinant
            out.forward[i] = forward
            out.level[i] = s / n - a * forward - c * left
            out.explained += forward * forward * out.weight
        out.found = True
        return True
