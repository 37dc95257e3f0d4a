"""Model of the watchdog: raises Reset if it is not fed in time."""

from .clock import Reset


class Watchdog:
    """clock: a Clock. Reset is raised from within the call that lets the time pass."""

    def __init__(self, clock):
        self._clock = clock
        self._timeout_us = 0
        self._due_us = 0
        self._round = 0  # counts start() and stop(): checks that an earlier start() has scheduled do nothing

    def start(self, timeout_us):
        """From now on feed() must be called within timeout_us."""
        self._timeout_us = timeout_us
        self._round += 1
        self.feed()
        self._check_later(self._round)

    def stop(self):
        """Feeding is no longer needed."""
        self._round += 1

    def feed(self):
        """Start the time-out again."""
        self._due_us = self._clock.now_us + self._timeout_us

    def _check_later(self, number):
        def check():
            if number == self._round:
                if self._clock.now_us >= self._due_us:
                    raise Reset
                self._check_later(number)

        self._clock.at(self._due_us, check)
