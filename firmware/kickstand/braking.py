"""Brakings, found from the speed alone."""

BEGIN_MPS2 = -0.8
END_MPS2 = -0.4
LOSS_MPS = 1.5  # a braking takes off at least this much speed
MIN_STRAIGHT = 0.7  # share of its time that has to be straight


class BrakingFinder:
    """update() with each change of speed; True when a braking has just ended.

    braking: one is going on; was_straight: the one that ended was straight enough.
    """

    def __init__(self):
        self.braking = False
        self.was_straight = False
        self._clear()

    def _clear(self):
        self._loss = 0.0
        self._straight_s = 0.0
        self._turning_s = 0.0

    def update(self, change_mps, seconds, straight):
        """straight: the vehicle did not turn during these seconds; None if it was too slow to tell."""
        acceleration = change_mps / seconds
        if self.braking and acceleration > END_MPS2:
            self.braking = False
            self.was_straight = self._straight_s >= MIN_STRAIGHT * (self._straight_s + self._turning_s) > 0.0
            ended = self._loss >= LOSS_MPS
            self._clear()
            return ended
        if self.braking or acceleration < BEGIN_MPS2:
            self.braking = True
            self._loss -= change_mps
            if straight:
                self._straight_s += seconds
            elif straight is not None:
                self._turning_s += seconds
        return False

    def interrupt(self):
        """Speeds are missing: what was going on is forgotten."""
        self.braking = False
        self._clear()
