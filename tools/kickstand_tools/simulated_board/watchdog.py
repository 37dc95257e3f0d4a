"""Model of the watchdog: Reset when it is not fed in time."""

from .clock import Reset


class Watchdog:
    """clock: has now_us and at()."""

    def __init__(self, clock):
        self._clock = clock
        self._timeout_us = 0
        self._due_us = 0
        self._round = 0  # tells the check of this start from those of earlier ones

    def start(self, timeout_us):
        """From now on feed() must be called within timeout_us."""
        self._timeout_us = timeout_us
        self._round += 1
        self.feed()
        self._check_later(self._round)

    def stop(self):
        """Nobody watches any more."""
        self._round += 1

    def feed(self):
        """All is well."""
        self._due_us = self._clock.now_us + self._timeout_us

    def _check_later(self, number):
        def check():
            if number == self._round:
                if self._clock.now_us >= self._due_us:
                    raise Reset
                self._check_later(number)

        self._clock.at(self._due_us, check)
