"""Brakings, found from the speed alone."""

BEGIN_MPS2 = -0.8
END_MPS2 = -0.4
LOSS_MPS = 1.5  # a braking takes off at least this much speed


class BrakingFinder:
    """update() with each change of speed; True when a braking has just ended.

    braking: one is going on; was_straight: of the one that ended, enough was straight to count for itself.
    """

    def __init__(self):
        self.braking = False
        self.was_straight = False
        self._loss = self._straight_loss = 0.0

    def update(self, change_mps, seconds, straight):
        """straight: the vehicle did not turn during these seconds."""
        acceleration = change_mps / seconds
        if self.braking and acceleration > END_MPS2:
            self.was_straight = self._straight_loss >= LOSS_MPS
            ended = self._loss >= LOSS_MPS
            self.interrupt()
            return ended
        if self.braking or acceleration < BEGIN_MPS2:
            self.braking = True
            self._loss -= change_mps
            if straight:
                self._straight_loss -= change_mps
        return False

    def interrupt(self):
        """Speeds are missing: what was going on is forgotten."""
        self.braking = False
        self._loss = self._straight_loss = 0.0
