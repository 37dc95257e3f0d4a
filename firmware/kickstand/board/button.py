"""A push button to ground: debounced, with short and long presses.

>>> button = Button(machine.Pin(15, machine.Pin.IN, machine.Pin.PULL_UP))
>>> event = button.poll(time.ticks_ms())        # 0, SHORT or LONG
"""

from time import ticks_diff

from ..units import const

SHORT = 1
LONG = 2

_DEBOUNCE_MS = const(20)  # a change of the contact counts if it lasts this long
_LONG_MS = const(800)  # shortest duration of a long press


class Button:
    """A debounced push button. Call poll() at least every 20 ms. pin: a machine.Pin with pull-up, low while pressed."""

    def __init__(self, pin):
        self._pin = pin
        self._pressed = self._raw = self.held()
        self._changed_ms = None
        self._pressed_ms = 0
        # True after the long press was reported. At first it is also True, to ignore a press that began before this
        # object existed
        self._long_sent = True

    def held(self):
        """Return True if the button is pressed now, without debouncing."""
        return not self._pin.value()

    def poll(self, now_ms):
        """Return SHORT when a short press ends, LONG once while a long press continues, else 0. now_ms: ticks_ms()."""
        raw = not self._pin.value()
        if self._changed_ms is None or raw != self._raw:
            self._raw = raw
            self._changed_ms = now_ms
            return 0
        if raw != self._pressed and ticks_diff(now_ms, self._changed_ms) >= _DEBOUNCE_MS:
            self._pressed = raw
            if raw:
                self._pressed_ms = now_ms
                self._long_sent = False
            elif not self._long_sent:
                self._long_sent = True
                return SHORT
        if self._pressed and not self._long_sent and ticks_diff(now_ms, self._pressed_ms) >= _LONG_MS:
            self._long_sent = True
            return LONG
        return 0
