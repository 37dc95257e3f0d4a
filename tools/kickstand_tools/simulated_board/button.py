"""Model of a push button to ground whose contacts bounce."""

BOUNCE_US = 4000
RELEASED_US = 150_000  # least time between two presses
_BOUNCES = 3  # short openings (or closings) after each edge


class Button:
    """closed: True while its contacts touch. seed: determines the random moments at which they bounce.

    charge_us: time in which the pin's pull-up charges a capacitor that is soldered to them, 0 for none.
    """

    def __init__(self, clock, seed=1):
        self.closed = False
        self.charge_us = 0
        self._clock = clock
        self._free_us = 0  # when a press that is asked for now can begin
        self._random = seed & 0x7FFFFFFF or 1

    def low(self, pulled_us):
        """True if its pin is low. pulled_us: the time at which the pin got a pull-up."""
        return self.closed or self._clock.now_us < pulled_us + self.charge_us

    def press(self, at_us, for_us):
        """Press it from at_us for for_us. at_us: None for now, or once the last such press is over, because a finger
        cannot press what it holds."""
        if at_us is None:
            at_us = max(self._clock.now_us, self._free_us)
            self._free_us = at_us + for_us + RELEASED_US
        self.turn(True, at_us)
        self.turn(False, at_us + for_us)

    def turn(self, closed, at_us):
        """Press (True) or release it (False) at at_us; it bounces for BOUNCE_US."""
        self._set_at(at_us, closed)
        step = BOUNCE_US // (2 * _BOUNCES)
        for i in range(1, 2 * _BOUNCES + 1):
            self._set_at(at_us + i * step - self._below(step // 2), closed if i % 2 == 0 else not closed)

    def _set_at(self, at_us, closed):
        def act():
            self.closed = closed

        self._clock.at(at_us, act)

    def _below(self, limit):
        self._random = (self._random * 1103515245 + 12345) & 0x7FFFFFFF
        return (self._random >> 8) % limit
