"""Brakings, and speedings-up, which show forward as well, found from the speed alone."""

BEGIN_MPS2 = 0.8
END_MPS2 = 0.4
CHANGE_MPS = 1.5  # a braking takes off at least this much speed


class BrakingFinder:
    """update() with each change of speed; True when a braking or a speeding-up has just ended.

    change: of the speed in the one that goes on or ended last (m/s, < 0: a braking); going_on. Whether it was straight
    depends on how late the speed is: answered for each of some lags.
    """

    def __init__(self, lags):
        self._straight = [0.0] * lags  # what of the change was straight
        self.interrupt()

    def interrupt(self):
        """Speeds are missing: what was going on is forgotten."""
        self.going_on = False
        self.change = 0.0
        for lag in range(len(self._straight)):
            self._straight[lag] = 0.0

    def update(self, change_mps, seconds, straight):
        """straight: for each lag, whether the vehicle did not turn during these seconds."""
        acceleration = change_mps / seconds
        if self.going_on and (acceleration if self.change > 0.0 else -acceleration) < END_MPS2:
            self.going_on = False
            if abs(self.change) >= CHANGE_MPS:
                return True
        if not self.going_on and abs(acceleration) > BEGIN_MPS2:
            self.interrupt()
            self.going_on = True
        if self.going_on:
            self.change += change_mps
            for lag in range(len(straight)):
                if straight[lag]:
                    self._straight[lag] += change_mps
        return False

    def was_straight(self, lag):
        """Of the one that ended last: enough of it was straight to count for itself."""
        return abs(self._straight[lag]) >= CHANGE_MPS
