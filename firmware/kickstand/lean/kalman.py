"""The covariance of a Kalman filter, updated in steps short enough for the time of one sample.

Matrices are lists of lists of floats, not arrays: on a board, reading an element of an array takes heap. The long
methods are generators, which yield where the work may be interrupted. Rows of Jacobians are written as ((state, value),
...), because most of their values are zero.
"""

from math import sqrt

from ..units import const

_MIN_VARIANCE = const(1e-10)  # rounding in 32-bit floats could make a variance negative
# How much is done between two yields: about a millisecond on an RP2040
_TERMS_PER_STEP = const(3)  # terms of a Jacobian's row
_ROWS_PER_STEP = const(8)  # rows of the covariance's triangle: the first eight of twelve are half of the work
_GATE = const(25.0)  # 5 sigma, squared. An innovation beyond it is not dropped, because the state may be what is wrong.


class Covariance:
    """P, the covariance of n states, and the correction of these states by measurements.

    variances: n initial variances, uncorrelated.
    """

    def __init__(self, variances):
        self.n = len(variances)
        self.rows = [[0.0] * self.n for _ in variances]
        for i, variance in enumerate(variances):
            self.rows[i][i] = variance
        self.correction = [0.0] * self.n
        self._column = [0.0] * self.n
        self.misfit = 0.0  # see update()

    def set_variance(self, i, variance):
        """Set the variance of state i, and its covariances with the other states to 0."""
        for k in range(self.n):
            self.rows[i][k] = self.rows[k][i] = 0.0
        self.rows[i][i] = variance

    def add_noise(self, i, variance):
        """Add process noise to the variance of state i. For states that do not depend on others."""
        self.rows[i][i] += variance

    def propagate_row(self, i, derivatives, seconds, noise):
        """Compute P = F P F^T for one row of F, plus process noise. A generator.

        derivatives: of state i's rate of change, ((j, d rate_i / d state_j), ...) with j other than i. seconds: length
        of the step. noise: added to state i's variance.
        """
        rows = self.rows
        row = rows[i]
        for m, (j, a) in enumerate(derivatives):
            if m == _TERMS_PER_STEP:
                yield
            a *= seconds
            source = rows[j]
            for k in range(self.n):
                row[k] += a * source[k]
        variance = row[i] + noise
        for j, a in derivatives:
            variance += a * seconds * row[j]
        row[i] = variance
        for k in range(self.n):
            rows[k][i] = row[k]  # P is symmetric
        yield

    def update(self, derivatives, innovation, variance):
        """Apply one scalar measurement: K = P H^T / (H P H^T + R), correction += K innovation, P -= K H P. A generator.

        derivatives: H, ((state, d measurement / d state), ...).  innovation: measured minus expected, for the states
        before this window's corrections.  variance: R, in the measurement's unit squared. Beyond _GATE the
        innovation's variance is raised until the innovation equals it. misfit is then the innovation in standard
        deviations.
        """
        rows, column, correction = self.rows, self._column, self.correction
        n = self.n
        j, h = derivatives[0]
        for i in range(n):
            column[i] = h * rows[j][i]
        for m in range(1, len(derivatives)):
            if m == _TERMS_PER_STEP:
                yield
            j, h = derivatives[m]
            row = rows[j]
            for i in range(n):
                column[i] += h * row[i]
        expected = variance
        for j, h in derivatives:
            expected += h * column[j]
            innovation -= h * correction[j]
        square = innovation * innovation
        self.misfit = innovation / sqrt(expected)
        if square > _GATE * expected:
            expected = square / _GATE
        innovation /= expected
        for i in range(n):
            correction[i] += column[i] * innovation
        yield
        for i in range(n):
            gain = column[i] / expected
            row = rows[i]
            for j in range(i + 1):
                rows[j][i] = row[j] = row[j] - gain * column[j]
            if row[i] < _MIN_VARIANCE:
                row[i] = _MIN_VARIANCE
            if i == _ROWS_PER_STEP - 1:
                yield
        yield

    def take_correction(self, i):
        """Return the correction of state i and set it to 0."""
        value = self.correction[i]
        self.correction[i] = 0.0
        return value
