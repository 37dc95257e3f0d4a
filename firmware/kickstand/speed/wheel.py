"""Speed from pulses: a reed contact or Hall switch to ground at a wheel, or a vehicle's speed signal.

The interrupt only notes when pulses come; it works on integers, because a hard one must take no heap.
"""

from time import ticks_diff, ticks_us

from machine import Pin

from ..errors import SpeedFault

MAX_MPS = 100.0  # pulses that follow faster are none
BOUNCE_US = 3000  # the contact must have been open for so long, or for a quarter of the shortest period
STOPPED_MPS = 0.5  # slower shows as standing
MIN_STOP_MS, MAX_STOP_MS = 500, 1800  # without a pulse: one magnet at walking pace shows as standing
REPORT_MS = 100
STANDING_MS = 200  # a speed of zero is told again so often
_TICKS = _COUNT = 0x3FFFFFFF  # ticks_diff() is negative after nine minutes of standing


class Wheel:
    """pin: a machine.Pin with pull-up.  pulses_per_metre: along the road.  irq: further arguments of Pin.irq().

    After poll() has returned a speed: age_ms, how long ago that was.
    """

    def __init__(self, pin, pulses_per_metre, irq):
        shortest_us = int(1e6 / (pulses_per_metre * MAX_MPS))
        self._shortest_us = shortest_us
        self._open_us = min(BOUNCE_US, shortest_us // 4)
        self._metre_us = 1e6 / pulses_per_metre  # m/s = this / period in us
        self._stop_ms = min(MAX_STOP_MS, max(MIN_STOP_MS, int(1000.0 / (pulses_per_metre * STOPPED_MPS))))
        self.count = 0  # of pulses, by the interrupt, and when the last one came
        self._pulse_us = ticks_us()
        self._opened_us = ticks_us()
        self._seen = 0  # count at the last report, and the time of that pulse
        self._seen_us = None
        self._report_ms = None
        self._moved_ms = None
        self.age_ms = 0
        self._pin = pin
        pin.irq(self._edge, Pin.IRQ_FALLING | Pin.IRQ_RISING, **irq)

    def _edge(self, pin):
        now = ticks_us()
        if pin.value():
            self._opened_us = now
        elif (now - self._opened_us) & _TICKS >= self._open_us and (now - self._pulse_us) & _TICKS >= self._shortest_us:
            self._pulse_us = now
            self.count = (self.count + 1) & _COUNT

    def poll(self, now_ms):
        """A new speed in m/s, or None. now_ms: ticks_ms()."""
        if self._report_ms is None:
            self._report_ms = now_ms
        waited_ms = ticks_diff(now_ms, self._report_ms)
        if waited_ms < REPORT_MS:
            return None
        count, pulse_us = self.count, self._pulse_us
        while count != self.count:  # one came between
            count, pulse_us = self.count, self._pulse_us
        pulses = (count - self._seen) & _COUNT
        if pulses:
            return self._pulses(pulses, count, pulse_us, now_ms)
        if self._moved_ms is None or ticks_diff(now_ms, self._moved_ms) < self._stop_ms or waited_ms < STANDING_MS:
            return None
        self._report_ms = now_ms
        self._seen_us = None  # the next pulse begins anew
        self.age_ms = self._stop_ms // 2  # it may have been moving again since, short of a pulse
        return 0.0

    def _pulses(self, pulses, count, pulse_us, now_ms):
        before_us = self._seen_us
        self._seen, self._seen_us = count, pulse_us
        self._report_ms = self._moved_ms = now_ms
        if before_us is None:
            return None
        period_us = ticks_diff(pulse_us, before_us)
        self.age_ms = (ticks_diff(ticks_us(), pulse_us) + period_us // 2) // 1000
        return pulses * self._metre_us / period_us

    def skip(self, now_ms):
        """Pulses until now may be lost or late, as interrupts were off: the next one begins anew."""
        if self._seen_us is not None or self._seen != self.count:
            self._moved_ms = now_ms
        self._seen = self.count
        self._seen_us = None

    def fault(self, now_ms):
        """None, or a SpeedFault: a wheel that has never turned may be a wire that is loose."""
        return SpeedFault("wheel-no-pulse") if self._moved_ms is None else None
