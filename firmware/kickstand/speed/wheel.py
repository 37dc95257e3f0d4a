"""Measures speed from pulses of a reed contact or Hall switch at a wheel, or of a vehicle's speed signal.

The interrupt only counts pulses and stores the time of the last pulse. The interrupt uses integers, because a hard
interrupt must take no heap. A storm of pulses, for example from an ignition cable, would leave no time for anything
else. In a storm the interrupt turns itself off, and poll() turns it on again later.

>>> wheel = Wheel(machine.Pin(14, machine.Pin.IN, machine.Pin.PULL_UP), 0.5, {"hard": True}, [])
>>> speed_mps = wheel.poll(time.ticks_ms())     # None if there is no new speed
"""

from time import ticks_add, ticks_diff, ticks_us

import micropython
from machine import Pin

from ..errors import Notice
from ..units import const

_MAX_MPS = const(100.0)  # largest speed of a wheel; pulses that imply a higher speed are interference
# A contact that was open for less than _BOUNCE_US, and for less than a quarter of the shortest period, bounces
_BOUNCE_US = const(3000)
_STOPPED_MPS = const(0.5)  # speed below which a wheel counts as standing
MIN_STOP_MS, MAX_STOP_MS = 500, 1800  # limits of the time after which a wheel without pulses counts as standing
_REPORT_MS = const(100)  # shortest time between two speeds from poll()
_STANDING_MS = const(200)  # shortest time between two speeds of zero from poll()
# STORM_EDGES edges in less than STORM_US are a storm, over 8,000 edges per second. The interrupt takes 33 us on a Pico,
# so at 30,000 edges per second nothing else would run. The interrupt ends such a storm after 2 ms, which is less than
# the time-out of a transfer. 50 pulses per metre at 70 m/s are not a storm.
STORM_EDGES, STORM_US = 64, 8_000
_STORM_PAUSE_MS = const(5000)  # time for which the interrupt is off after a storm
_SOFT_PERIOD_US = const(3333)  # period below which soft interrupts, such as an ESP32's, lose over 2 % of the pulses
# Counts and times wrap at 30 bits. The interrupt subtracts times with this mask, because ticks_diff() would be negative
# after nine minutes of standing.
_TICKS = _COUNT = 0x3FFFFFFF


class Wheel:
    """A speed sensor that gives pulses.

    Args:
        pin: a machine.Pin with pull-up.
        pulses_per_metre: number of pulses per metre of road.
        irq: dictionary of further arguments of Pin.irq().
        notices: list to which the Notice of a new fault is appended.

    Attributes:
        age_ms: the age of the speed that poll() last returned.
    """

    def __init__(self, pin, pulses_per_metre, irq, notices):
        self._notices = notices
        shortest_us = int(1e6 / (pulses_per_metre * _MAX_MPS))
        self._shortest_us = shortest_us
        self._open_us = min(_BOUNCE_US, shortest_us // 4)
        self._metre_us = 1e6 / pulses_per_metre  # time between two pulses at 1 m/s
        self._stop_ms = min(MAX_STOP_MS, max(MIN_STOP_MS, int(1000.0 / (pulses_per_metre * _STOPPED_MPS))))
        self.count = 0  # number of pulses that the interrupt has counted
        self._pulse_us = ticks_us()  # time of the last pulse
        self._opened_us = ticks_us()  # time when the contact last opened
        self._seen = 0  # `count` when poll() last returned a speed
        self._seen_us = None  # time of the last pulse that _seen counts; None if no period begins with that pulse
        self._report_ms = None  # time when poll() last returned a speed
        self._moved_ms = None  # time when poll() last found a new pulse
        self.age_ms = 0
        self._pin = pin
        self._irq = irq
        self._noisy = False  # True after a storm, until the next speed
        self._soft = not irq.get("hard")
        self._too_quick = None  # True while pulses are too fast for a soft interrupt; None before the first pulses
        # An exception in a hard interrupt cannot take heap for its report. MicroPython for Linux lacks the function
        keep_room = getattr(micropython, "alloc_emergency_exception_buf", None)
        if keep_room and not self._soft:
            keep_room(100)
        self._listen()

    def _listen(self):
        """Turn the interrupt on."""
        self._off = False  # True after the interrupt has turned itself off
        self._off_ms = None  # time when poll() noticed that the interrupt is off
        self._edges = STORM_EDGES  # number of edges until the time since _edges_us is compared with STORM_US
        self._edges_us = ticks_us()
        # The next three attributes are used for soft interrupts only
        self._level = None  # level of the pin at the last interrupt
        self._same = False  # True after the first of two interrupts that find the level unchanged
        self._usual_us = 0  # usual time from pulse to pulse, 0 if unknown
        self._pin.irq(self._soft_edge if self._soft else self._edge, Pin.IRQ_FALLING | Pin.IRQ_RISING, **self._irq)

    def _edge(self, pin):
        time_us = ticks_us()
        self._edges -= 1
        if not self._edges:
            self._edges = STORM_EDGES
            if (time_us - self._edges_us) & _TICKS < STORM_US:
                self._off = True
                pin.irq(None)  # turned off here, because in a storm the loop may get no time; irq(None) takes no heap
            self._edges_us = time_us
        if pin.value():
            self._opened_us = time_us
        elif (time_us - self._opened_us) & _TICKS >= self._open_us:
            if (time_us - self._pulse_us) & _TICKS >= self._shortest_us:
                self._pulse_us = time_us
                self.count = (self.count + 1) & _COUNT

    def _soft_edge(self, pin):
        """Handle a soft interrupt.

        During a transfer to sensor or display the interrupt waits. If the contact closes and opens meanwhile, two
        interrupts find the level unchanged. The two interrupts count as one pulse, unless they come so early that the
        contact is bouncing."""
        level = pin.value()
        if level != self._level or self._edges == 1:
            self._level, self._same = level, False
            self._edge(pin)
            return
        self._edges -= 1
        self._same = not self._same
        usual_us = self._usual_us
        if usual_us and not self._same:
            waited_us = (ticks_us() - self._pulse_us) & _TICKS
            if waited_us >= usual_us - (usual_us >> 2):
                self._pulse_us = (self._pulse_us + min(waited_us, usual_us)) & _TICKS
                self.count = (self.count + 1) & _COUNT

    def poll(self, now_ms):
        """Return a new speed in m/s, or None. now_ms: ticks_ms()."""
        if self._off:
            return self._wait(now_ms)
        if self._report_ms is None:
            self._report_ms = now_ms
        waited_ms = ticks_diff(now_ms, self._report_ms)
        if waited_ms < _REPORT_MS:
            return None
        count, pulse_us = self.count, self._pulse_us
        while count != self.count:  # repeat if a pulse arrived between the two reads
            count, pulse_us = self.count, self._pulse_us
        pulses = (count - self._seen) & _COUNT
        if pulses:
            return self._pulses(pulses, count, pulse_us, now_ms)
        if self._moved_ms is None or ticks_diff(now_ms, self._moved_ms) < self._stop_ms or waited_ms < _STANDING_MS:
            # keep _report_ms recent, because after 6 days ticks_diff() is negative
            if waited_ms > MAX_STOP_MS:
                self._report_ms = ticks_add(now_ms, -MAX_STOP_MS)
            return None
        self._report_ms = now_ms
        # a recent time, because after 6 days ticks_diff() is negative
        self._moved_ms = ticks_add(now_ms, -self._stop_ms)
        self._noisy = False
        self._usual_us = 0
        self._seen_us = None  # the next period begins with the next pulse
        self.age_ms = self._stop_ms // 2  # the wheel may have stopped at any time since the last pulse
        return 0.0

    def _wait(self, now_ms):
        """Turn the interrupt on again after _STORM_PAUSE_MS. The pulses counted in the storm give no speed."""
        if self._off_ms is None:
            self._off_ms = now_ms
            if not self._noisy:
                self._noisy = True
                self._notices.append(Notice("wheel-storm"))
        elif ticks_diff(now_ms, self._off_ms) >= _STORM_PAUSE_MS:
            self._seen, self._seen_us = self.count, None
            if self._moved_ms is not None:
                self._moved_ms = now_ms
            self._listen()

    def _pulses(self, pulses, count, pulse_us, now_ms):
        """Return the speed in m/s, or None.

        Args:
            pulses: number of new pulses.
            count: number of all pulses.
            pulse_us: time of the last pulse.
            now_ms: ticks_ms().
        """
        before_us = self._seen_us
        self._seen, self._seen_us = count, pulse_us
        self._report_ms = self._moved_ms = now_ms
        if before_us is None:
            return None
        self._noisy = False
        period_us = ticks_diff(pulse_us, before_us)
        self._usual_us = period_us // pulses
        if self._soft and self._usual_us < _SOFT_PERIOD_US:
            if self._too_quick is None:
                self._notices.append(Notice("wheel-quick"))
            self._too_quick = True
            return None
        self._too_quick = False
        self.age_ms = (ticks_diff(ticks_us(), pulse_us) + period_us // 2) // 1000
        return pulses * self._metre_us / period_us

    def place(self, now_ms):
        """Return None, because a wheel has no position."""

    def after_stall(self, now_ms):
        """Begin the next period with the next pulse. While interrupts were off, pulses may have been lost or late."""
        if self._seen_us is not None or self._seen != self.count:
            self._moved_ms = now_ms
        self._seen = self.count
        self._seen_us = None

    def fault(self, now_ms):
        """Return a Notice for a storm, for pulses that are too fast, or if no pulse has ever arrived, else None."""
        if self._noisy:
            return Notice("wheel-storm")
        if self._too_quick:
            return Notice("wheel-quick")
        return Notice("no-pulse") if self._moved_ms is None else None
