"""Models of the contacts between a pin and ground: a push button, and a reed contact at a wheel. Both bounce."""

from .clock import NEVER_US

BOUNCE_US = 4000  # time for which the button bounces
RELEASED_US = 150_000  # least time between two presses
_BOUNCES = 3  # number of short openings (or closings) after each edge of the button

_CLOSED_SHARE = 0.1  # the contact is closed for this share of the way between two pulses
_LOOK_US = 20_000  # longest time between two readings of the speed by the wheel's model
_CREEP_MPS = 0.02  # a lower speed counts as standing


class Contact:
    """A contact between a pin and ground.

    closed: True while the contact is closed.
    broken_us: time at which its wire breaks.
    """

    def __init__(self, clock, broken_us=NEVER_US):
        self.closed = False
        self._clock = clock
        self._broken_us = broken_us
        self._edge = None

    def connect(self, edge):
        """Call edge(level of the pin) at each change from now on. None ends the calls."""
        self._edge = edge

    def _change(self, closed, at_us, bounces_us):
        """Close or open the contact at at_us. At each of the bounces, an even number, it changes again."""
        self._set_at(at_us, closed)
        for i, bounce_us in enumerate(bounces_us):
            self._set_at(bounce_us, closed if i % 2 else not closed)

    def _set_at(self, at_us, closed):
        def act():
            is_closed = closed and self._clock.now_us < self._broken_us
            if is_closed != self.closed:
                self.closed = is_closed
                if self._edge:
                    self._edge(0 if is_closed else 1)

        self._clock.at(at_us, act)


class Button(Contact):
    """A push button. seed: determines the random moments at which it bounces.

    charge_us: time in which the pin's pull-up charges a capacitor at the contacts; 0 without a capacitor.
    """

    def __init__(self, clock, seed=1):
        super().__init__(clock)
        self.charge_us = 0
        self._free_us = 0  # earliest start of the next press
        self._random = seed & 0x7FFFFFFF or 1

    def low(self, pulled_us):
        """True if the button's pin is low. pulled_us: the time at which the pin's pull-up was switched on."""
        return self.closed or self._clock.now_us < pulled_us + self.charge_us

    def press(self, at_us, for_us):
        """Press the button from the time at_us on, for the duration for_us.

        at_us: None to press now, or after a press that is still scheduled.
        """
        if at_us is None:
            at_us = max(self._clock.now_us, self._free_us)
            self._free_us = at_us + for_us + RELEASED_US
        self.turn(True, at_us)
        self.turn(False, at_us + for_us)

    def turn(self, closed, at_us):
        """Press (True) or release (False) the button at at_us. It bounces for BOUNCE_US."""
        step = BOUNCE_US // (2 * _BOUNCES)
        moments = range(step, BOUNCE_US + 1, step)
        self._change(closed, at_us, [at_us + us - self._random_below(step // 2) for us in moments])

    def _random_below(self, limit):
        self._random = (self._random * 1103515245 + 12345) & 0x7FFFFFFF
        return (self._random >> 8) % limit


class Wheel(Contact):
    """A wheel contact that closes when a magnet passes.

    speed: function speed(t_s) that returns the speed of the vehicle in m/s.
    bounce_us: time for which the contact bounces at each edge. 0 for no bouncing.
    until_s: time at which its wire breaks.
    noise_hz: pulses per second that a neighbouring cable induces. These pulses replace the wheel's pulses. 0 for none.
    """

    def __init__(self, clock, speed, pulses_per_metre=0.5, bounce_us=0, until_s=1e9):
        super().__init__(clock, int(until_s * 1e6))
        self.noise_hz = 0
        self._speed = speed
        self._pulses_per_metre = pulses_per_metre
        self._bounces_us = [i * bounce_us // 4 for i in range(1, 5)] if bounce_us else []
        self._turned = 0.5  # share of the way to the next pulse
        self._look_us = clock.now_us
        clock.at(clock.now_us, self._add_distance)

    def _add_distance(self):
        """Add the distance since the last call. At a pulse, schedule the contact's edges. Schedule the next call."""
        now_us = self._clock.now_us
        speed = self._speed(now_us / 1e6)
        rate = speed * self._pulses_per_metre / 1e6 if speed > _CREEP_MPS else 0.0  # pulses per us
        if self.noise_hz:
            rate = self.noise_hz / 1e6 if self._edge else 0.0  # skipped if nobody listens, to save time
        self._turned += rate * (now_us - self._look_us)
        self._look_us = now_us
        if self._turned >= 0.999:
            self._turned -= 1.0
            for closed, at_us in ((True, now_us), (False, now_us + int(_CLOSED_SHARE / rate))):
                self._change(closed, at_us, [at_us + us for us in self._bounces_us])
        left_us = int((1.0 - self._turned) / rate) + 1 if rate else _LOOK_US
        self._clock.at(now_us + min(_LOOK_US, left_us), self._add_distance)
