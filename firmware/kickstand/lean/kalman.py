"""A covariance matrix and its two operations, in pieces short enough for a sample's time.

Lists of floats, not arrays: on a board reading an array's element takes heap, reading a list's does not. Generators
yield where the work may be interrupted.
"""

MIN_VARIANCE = 1e-10  # rounding in float32 could make it negative
# Pieces of about a millisecond on an RP2040
TERMS = 3  # of a measurement or a transition
ROWS = 8  # of the twelve: about half of the products
GATE = 25.0  # beyond five sigma an innovation counts for less, but counts: the model may be what is wrong


class Covariance:
    """Covariance of n states, and the correction of the states by what is measured. variances: n initial values."""

    def __init__(self, variances):
        self.n = len(variances)
        self.rows = [[0.0] * self.n for _ in variances]
        for i, variance in enumerate(variances):
            self.rows[i][i] = variance
        self.correction = [0.0] * self.n
        self._column = [0.0] * self.n

    def forget(self, i, variance):
        """State i is known afresh: it no longer has to do with the others."""
        for k in range(self.n):
            self.rows[i][k] = self.rows[k][i] = 0.0
        self.rows[i][i] = variance

    def carry(self, i, terms, growth):
        """Let state i change by the sum of a times state j for ((j, a), ...), j other than i, and its variance grow.

        P = F P F^T with F = I + sum of a e_i e_j^T.  Yields between pieces.
        """
        rows = self.rows
        row = rows[i]
        for m, (j, a) in enumerate(terms):
            if m == TERMS:
                yield
            source = rows[j]
            for k in range(self.n):
                row[k] += a * source[k]
        variance = row[i] + growth
        for j, a in terms:
            variance += a * row[j]
        row[i] = variance
        for k in range(self.n):
            rows[k][i] = row[k]  # P is symmetric
        yield

    def measure(self, terms, innovation, variance):
        """Correct by one scalar measurement h x with h given as terms ((state, coefficient), ...).

        innovation: measured minus expected, the correction so far left out.  Yields between pieces.
        """
        rows, column, correction = self.rows, self._column, self.correction
        n = self.n
        j, h = terms[0]
        for i in range(n):
            column[i] = h * rows[j][i]
        for m in range(1, len(terms)):
            if m == TERMS:
                yield
            j, h = terms[m]
            row = rows[j]
            for i in range(n):
                column[i] += h * row[i]
        expected = variance
        for j, h in terms:
            expected += h * column[j]
            innovation -= h * correction[j]
        if innovation * innovation > GATE * expected:
            expected = innovation * innovation / GATE
        innovation /= expected
        for i in range(n):
            correction[i] += column[i] * innovation
        yield
        for i in range(n):
            gain = column[i] / expected
            row = rows[i]
            for j in range(i + 1):
                rows[j][i] = row[j] = row[j] - gain * column[j]
            if row[i] < MIN_VARIANCE:
                row[i] = MIN_VARIANCE
            if i == ROWS - 1:
                yield
        yield

    def take_correction(self, i):
        """The correction of state i, which is then 0 again."""
        value = self.correction[i]
        self.correction[i] = 0.0
        return value
