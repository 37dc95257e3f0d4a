"""The spread of directions in a plane: circular dispersion (N. I. Fisher, 1993, section 2.3).

    d = (1 - rho2) / (2 R^2),  R = |mean of e^(i a)|,  rho2 = the mean cosine of 2 (a - mean direction)

For small spreads d is about the variance in rad^2: 0.02 is 8 degrees, 0.005 is 4. Running sums are kept, so that rho2
needs no second pass over the directions.
"""

NONE = 9.9  # the value without a mean direction, such as for opposite directions; also the largest value


class CircularDispersion:
    """Directions of vectors in a plane, all of equal weight whatever the vectors' lengths. count: their number."""

    def __init__(self):
        self.clear()

    def clear(self):
        """Forget all directions."""
        self.count = 0
        self._cos = self._sin = self._cos2 = self._sin2 = 0.0

    def add(self, x, y, length):
        """Add the direction of the vector (x, y). length: of that vector, > 0."""
        c, s = x / length, y / length
        self.count += 1
        self._cos += c
        self._sin += s
        self._cos2 += c * c - s * s
        self._sin2 += 2.0 * c * s

    def join(self, other):
        """Add all directions of another CircularDispersion."""
        self.count += other.count
        self._cos += other._cos
        self._sin += other._sin
        self._cos2 += other._cos2
        self._sin2 += other._sin2

    def value(self):
        """d, at most NONE."""
        r2 = self._cos * self._cos + self._sin * self._sin  # (count R)^2
        n = self.count
        if r2 <= 1e-6 * n * n:
            return NONE
        # cos 2(a - m) = cos 2a cos 2m + sin 2a sin 2m, and e^(2im) = (C + iS)^2 / r2
        cos2m = (self._cos * self._cos - self._sin * self._sin) / r2
        sin2m = 2.0 * self._cos * self._sin / r2
        rho2 = (self._cos2 * cos2m + self._sin2 * sin2m) / n
        return min(NONE, max(0.0, (1.0 - rho2) * n * n / (2.0 * r2)))
