"""Brakings, found from the speed alone."""

BEGIN_MPS2 = -0.8
END_MPS2 = -0.4
LOSS_MPS = 1.5  # a braking takes off at least this much speed


class BrakingFinder:
    """update() with each change of speed; True when a braking has just ended. braking: one is going on.

    Whether it was straight depends on how late the speed is: answered for each of some lags.
    """

    def __init__(self, lags):
        self.braking = False
        self._loss = 0.0
        self._straight = [0.0] * lags  # what of the loss was straight

    def update(self, change_mps, seconds, straight):
        """straight: for each lag, whether the vehicle did not turn during these seconds."""
        acceleration = change_mps / seconds
        if self.braking and acceleration > END_MPS2:
            self.braking = False
            return self._loss >= LOSS_MPS
        if not self.braking and acceleration < BEGIN_MPS2:
            self.interrupt()
            self.braking = True
        if self.braking:
            self._loss -= change_mps
            for lag in range(len(straight)):
                if straight[lag]:
                    self._straight[lag] -= change_mps
        return False

    def was_straight(self, lag):
        """Of the braking that ended last: enough of it was straight to count for itself."""
        return self._straight[lag] >= LOSS_MPS

    def interrupt(self):
        """Speeds are missing: what was going on is forgotten."""
        self.braking = False
        self._loss = 0.0
        for lag in range(len(self._straight)):
            self._straight[lag] = 0.0
