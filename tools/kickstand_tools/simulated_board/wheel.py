"""Model of a reed contact at a wheel: it closes at each magnet that passes, and bounces."""

_CLOSED_SHARE = 0.1  # of the way between two pulses: the magnet is near
_LOOK_US = 20_000  # the model reads the speed at least this often
_CREEP_MPS = 0.02  # slower counts as standing


class Wheel:
    """speed(t_s): speed of the vehicle, m/s.  bounce_us: time for which the contact bounces at each edge, 0 for none.

    closed: True while it connects the pin to ground.  until_s: time at which its wire breaks.  noise_hz: pulses per
    second that a cable beside its own induces, in place of the wheel's; 0 for none.
    """

    def __init__(self, clock, speed, pulses_per_metre=0.5, bounce_us=0, until_s=1e9):
        self.closed = False
        self.noise_hz = 0
        self._edge = None
        self._clock = clock
        self._speed = speed
        self._pulses_per_metre = pulses_per_metre
        self._bounce_us = bounce_us
        self._until_us = int(until_s * 1e6)
        self._turned = 0.5  # share of the way to the next pulse
        self._look_us = clock.now_us
        clock.at(clock.now_us, self._look)

    def connect(self, edge):
        """Call edge(level of the pin) at each change from now on. None: call nothing."""
        self._edge = edge

    def disconnect(self):
        """Stop calling edge()."""
        self._edge = None

    def _look(self):
        """Add the way since the last call; at a pulse schedule closing and opening; schedule the next call."""
        now_us = self._clock.now_us
        speed = self._speed(now_us / 1e6)
        rate = speed * self._pulses_per_metre / 1e6 if speed > _CREEP_MPS else 0.0  # pulses per us
        if self.noise_hz:
            rate = self.noise_hz / 1e6 if self._edge else 0.0  # nobody listens: spare the time
        self._turned += rate * (now_us - self._look_us)
        self._look_us = now_us
        if self._turned >= 0.999:
            self._turned -= 1.0
            self._turn(True, now_us)
            self._turn(False, now_us + int(_CLOSED_SHARE / rate))
        left_us = int((1.0 - self._turned) / rate) + 1 if rate else _LOOK_US
        self._clock.at(now_us + min(_LOOK_US, left_us), self._look)

    def _turn(self, closed, at_us):
        self._set_at(at_us, closed)
        if self._bounce_us:
            for i in range(1, 5):
                self._set_at(at_us + i * self._bounce_us // 4, closed if i % 2 == 0 else not closed)

    def _set_at(self, at_us, closed):
        def act():
            level = closed and self._clock.now_us < self._until_us
            if level != self.closed:
                self.closed = level
                if self._edge:
                    self._edge(0 if level else 1)

        self._clock.at(at_us, act)
