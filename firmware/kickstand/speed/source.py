"""Opens the speed source set in config.py, and rejects speeds that no vehicle can have.

A source is a Gps or a Wheel. Both have poll(now_ms), place(now_ms), after_stall(now_ms), fault(now_ms) and age_ms.
"""

from time import ticks_diff

from machine import UART, Pin

from ..board import port
from ..errors import SettingsError
from ..units import const

_MAX_MPS = const(100.0)
_MAX_CHANGE_MPS2 = const(15.0)  # largest change of speed per second; no tyre has enough grip for a larger change
_NOISE_MPS = const(2.0)  # noise of a speed, by which a change of speed may exceed its limit
_GIVE_UP_MS = const(3000)  # duration of rejected speeds that shows that the last accepted speed was wrong
# Bytes of half a second at 9600 baud. This buffer is large enough while flash is written or the sensor is set up.
_RX_BUFFER = const(512)
_RX_PER_S = const(50)  # a faster receiver has a buffer of 0.2 s: 2304 bytes at 115,200 baud


class Speed:
    """Reads plausible speeds.

    The source's place() belongs to the last speed that was read, even if poll() has rejected that speed.

    Args:
        source: a Gps or a Wheel.

    Attributes:
        age_us: the age of the speed that poll() last returned.
    """

    def __init__(self, source):
        self.source = source
        self._last = None  # the last accepted speed in m/s
        self._last_ms = 0  # ticks_ms() of the last accepted speed
        self.age_us = 0

    def poll(self, now_ms):
        """Return a new speed in m/s and set age_us. Return None without a new speed, or if it is rejected.

        A speed outside 0 to _MAX_MPS is rejected. A speed that no vehicle could have reached from the last accepted
        speed is also rejected, but only for _GIVE_UP_MS. Call this in each pass of the loop. now_ms: ticks_ms()."""
        speed = self.source.poll(now_ms)
        if self._last is not None:
            waited_ms = ticks_diff(now_ms, self._last_ms)
            # waited_ms is checked even without a new speed, because after 6 days ticks_diff() is negative
            if waited_ms >= _GIVE_UP_MS:
                self._last = None
        if speed is None or not 0.0 <= speed <= _MAX_MPS:
            return None
        if self._last is not None:
            allowed = _NOISE_MPS + _MAX_CHANGE_MPS2 * ticks_diff(now_ms, self._last_ms) / 1000.0
            if not -allowed <= speed - self._last <= allowed:
                return None
        self._last = speed
        self._last_ms = now_ms
        self.age_us = 1000 * self.source.age_ms
        return speed


def open_speed(settings, notices):
    """Open the speed source of a Settings and return a Speed. SPEED must not be None. Raises SettingsError for pins
    that cannot be used.

    Args:
        notices: list to which the Notice of a new fault is appended.
    """
    if settings.SPEED == "gps":
        from .gps import Gps

        return Speed(Gps(_open_uart(settings)))
    from .wheel import Wheel

    return Speed(Wheel(settings.open_pin("WHEEL_PIN"), settings.PULSES_PER_METRE, port.PIN_IRQ, notices))


def _open_uart(settings):
    pins = settings.GPS_TX, settings.GPS_RX
    # Set TX too, although nothing is sent. The default TX of a Pico is one of the sensor's pins.
    try:
        tx, rx = Pin(pins[0]), Pin(pins[1])
        size = max(_RX_BUFFER, settings.GPS_BAUD // _RX_PER_S)
        return UART(settings.GPS_UART, settings.GPS_BAUD, tx=tx, rx=rx, rxbuf=size, timeout=0)
    except ValueError as error:
        raise SettingsError("uart-pins", "GPS_TX / GPS_RX", *pins, settings.GPS_UART, str(error))
