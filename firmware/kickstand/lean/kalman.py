"""The covariance of a Kalman filter, updated in steps short enough for the time of one sample.

Nearly all of the work is sums of products. On a board a product of floats takes 12 us and 32 bytes of heap. So on a
board machine code computes these sums on arrays, without heap. The long methods are generators, which yield where the
work may be interrupted. Rows of Jacobians are written as ((state, value), ...), because most of their values are zero.
"""

from array import array
from math import sqrt

from ..quick import load, plain
from ..units import const

# Lower bound of a variance, because rounding in 32-bit floats could make a variance negative
_MIN_VARIANCE = const(1e-10)
# Number of terms of a Jacobian's row that are processed between two yields. Without machine code three terms take a
# millisecond.
_TERMS_PER_STEP = const(3)
# Largest squared innovation, in variances, with full weight (5 sigma). Larger innovations get less weight. No
# innovation is rejected, because the state may be wrong.
_GATE = const(25.0)


def add_products_python(out, factors, source, n, rows):
    """Add factors[i] * source[k] to out[i * n + k], for i below rows and k below n.

    out, factors, source: arrays of floats. rows: 1, or n for a symmetric matrix. Half of a symmetric matrix is computed
    and copied to the other half. On the board add_products() is the machine code of quick_viper.py, for array("f").
    Elsewhere add_products() is this function.
    """
    for i in range(rows):
        factor = factors[i]
        for k in range(i + 1 if rows > 1 else n):
            value = out[i * n + k] + factor * source[k]
            out[i * n + k] = value
            if rows > 1:
                out[k * n + i] = value


def _adding():
    """Return arrays and their mark. Some of the sums grow, vanish, change their sign or are rounded."""
    sums = array("f", (0.65625, 0, 0, -0.75, 8388609, 0, 1e-9, 3e9, -0.984))
    return (sums, array("f", (1.5, -2.6875, 0.75)), array("f", (-0.4375, 98304.5, 1.3125)), 3, 3), 0x6E921598


(add_products,) = load("quick_viper", ("add_products", _adding))
if "add_products" in plain:  # as plain Python it cannot take floats apart
    add_products = add_products_python
del _adding
_KIND = "d" if add_products is add_products_python else "f"  # type of the arrays' elements


class Covariance:
    """P, the covariance of n states, and the correction of these states by measurements.

    variances: n initial variances of uncorrelated states.
    Attributes:
        rows        P, n rows of n floats
        correction  n floats, which the owner adds to the states
        misfit      the last innovation, in standard deviations
    """

    def __init__(self, variances):
        n = self.n = len(variances)
        self._zeros = array(_KIND, [0.0] * n)
        self._p = array(_KIND, [0.0] * n * n)
        self._divide()
        for i, variance in enumerate(variances):
            self._p[i * n + i] = variance
        self.correction, self._column, self._gain = [array(_KIND, self._zeros) for _ in range(3)]
        self._factor = array(_KIND, [0.0])
        self.misfit = 0.0

    def _divide(self):
        n, elements = self.n, memoryview(self._p)
        # Parts of _p. The type checker treats the elements of a memoryview as integers.
        self.rows = [elements[n * i : n * (i + 1)] for i in range(n)]  # type: list

    def __getstate__(self):  # without the memoryviews in `rows`, which copy and pickle on a computer cannot copy
        return {name: value for name, value in self.__dict__.items() if name != "rows"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._divide()

    def set_variance(self, i, variance):
        """Set the variance of state i, and its covariances with the other states to 0."""
        p, n = self._p, self.n
        for k in range(n):
            p[i * n + k] = p[k * n + i] = 0.0
        p[i * n + i] = variance

    def add_noise(self, i, variance):
        """Add process noise to the variance of state i. Use this method for states that do not depend on other
        states."""
        self._p[i * self.n + i] += variance

    def propagate_row(self, i, derivatives, seconds, noise):
        """Compute P = F P F^T for one row of F, plus process noise. A generator.

        derivatives: ((j, d rate_i / d state_j), ...), where rate_i is the rate of change of state i. j is never i.
        seconds: length of the step. noise: added to state i's variance.
        """
        rows, factor, n = self.rows, self._factor, self.n
        row = rows[i]
        for m, (j, a) in enumerate(derivatives):
            if m == _TERMS_PER_STEP:
                yield
            factor[0] = a * seconds
            add_products(row, factor, rows[j], n, 1)
        variance = row[i] + noise
        for j, a in derivatives:
            variance += a * seconds * row[j]
        row[i] = variance
        for k in range(n):
            rows[k][i] = row[k]  # P is symmetric
        yield

    def update(self, derivatives, innovation, variance):
        """Apply one scalar measurement: K = P H^T / (H P H^T + R), correction += K innovation, P -= K H P. A generator.

        derivatives: H, ((state, d measurement / d state), ...). innovation: the measured value minus the value expected
        from the states before this window's corrections. variance: R, in the measurement's unit squared. If the squared
        innovation exceeds _GATE times its expected variance, this variance is raised until they are equal.
        """
        p, rows, column, gain, factor = self._p, self.rows, self._column, self._gain, self._factor
        correction, n = self.correction, self.n
        column[:] = self._zeros
        for m, (j, h) in enumerate(derivatives):
            if m == _TERMS_PER_STEP:
                yield
            factor[0] = h
            add_products(column, factor, rows[j], n, 1)
        expected = variance
        for j, h in derivatives:
            expected += h * column[j]
            innovation -= h * correction[j]
        square = innovation * innovation
        self.misfit = innovation / sqrt(expected)
        if square > _GATE * expected:
            expected = square / _GATE
        factor[0] = innovation / expected
        add_products(correction, factor, column, n, 1)
        yield
        gain[:] = self._zeros
        factor[0] = -1.0 / expected
        add_products(gain, factor, column, n, 1)
        add_products(p, gain, column, n, n)
        yield
        for i in range(0, n * n, n + 1):
            if p[i] < _MIN_VARIANCE:
                p[i] = _MIN_VARIANCE
        yield

    def take_correction(self, i):
        """Return the correction of state i and set it to 0."""
        value = self.correction[i]
        self.correction[i] = 0.0
        return value
