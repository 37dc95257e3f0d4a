"""One push button to ground: debounced, short and long presses."""

from time import ticks_diff

SHORT = 1
LONG = 2

DEBOUNCE_MS = 20
LONG_MS = 800


class Button:
    """pin: a machine.Pin with pull-up, low while pressed. Call poll() at least every 20 ms or so."""

    def __init__(self, pin):
        self._pin = pin
        self._pressed = self._raw = self.held()  # a press that began before this was not meant for us
        self._changed_ms = None
        self._pressed_ms = 0
        self._long_sent = True

    def held(self):
        """The pin as it is now, not debounced."""
        return not self._pin.value()

    def poll(self, now_ms):
        """0, SHORT (on release) or LONG (while still held). now_ms: time.ticks_ms()."""
        raw = not self._pin.value()
        if self._changed_ms is None or raw != self._raw:
            self._raw = raw
            self._changed_ms = now_ms
            return 0
        if raw != self._pressed and ticks_diff(now_ms, self._changed_ms) >= DEBOUNCE_MS:
            self._pressed = raw
            if raw:
                self._pressed_ms = now_ms
                self._long_sent = False
            elif not self._long_sent:
                self._long_sent = True
                return SHORT
        if self._pressed and not self._long_sent and ticks_diff(now_ms, self._pressed_ms) >= LONG_MS:
            self._long_sent = True
            return LONG
        return 0
