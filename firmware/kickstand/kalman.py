"""A covariance matrix and its two operations, in pieces short enough for a sample's time.

Plain float32 loops on preallocated rows. Generators yield where the work may be interrupted.
"""

from array import array

GATE = (
    25.0  # innovations beyond five sigma are believed less, not thrown away: the model may be what is wrong
)


class Covariance:
    """Covariance of n states. variances: n initial values. Errors of a linearised state x with correction
    dx."""

    def __init__(self, variances):
        self.n = len(variances)
        self.rows = [array("f", [0.0] * self.n) for _ in variances]
        for i, variance in enumerate(variances):
            self.rows[i][i] = variance
        self.correction = array("f", [0.0] * self.n)
        self._column = array("f", [0.0] * self.n)

    def carry(self, i, j, a):
        """State i grows by a times the error of state j: P = (I + a e_i e_j^T) P (I + a e_i e_j^T)^T."""
        rows = self.rows
        to, source = rows[i], rows[j]
        for k in range(self.n):
            to[k] += a * source[k]
        for row in rows:
            row[i] += a * row[j]

    def measure(self, terms, innovation, variance):
        """Correct by one scalar measurement h x with h given as terms ((state, coefficient), ...).

        innovation: measured minus expected with the correction so far left out.  Yields between pieces.
        """
        rows, column, correction = self.rows, self._column, self.correction
        n = self.n
        for i in range(n):
            row = rows[i]
            total = 0.0
            for j, h in terms:
                total += h * row[j]
            column[i] = total
        expected = variance
        for j, h in terms:
            expected += h * column[j]
            innovation -= h * correction[j]
        square = innovation * innovation
        if square > GATE * expected:
            expected = square / GATE
        innovation /= expected
        for i in range(n):
            correction[i] += column[i] * innovation
        yield
        for i in range(n):
            gain = column[i] / expected
            row = rows[i]
            for j in range(i + 1):
                value = row[j] - gain * column[j]
                row[j] = value
                rows[j][i] = value
            if i == n // 2:
                yield
        yield

    def take_correction(self, i):
        """The correction of state i, which is then 0 again."""
        value = self.correction[i]
        self.correction[i] = 0.0
        return value
