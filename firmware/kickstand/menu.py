"""The menu behind a long press: short for the next entry, long to choose it."""

from time import ticks_add, ticks_diff

from .button import LONG, SHORT
from .pages import ARROW

ENTRIES = ("Align the bike", "Six positions", "Reset maxima", "Sensor info", "Leave menu")
ALIGN, SIX, RESET, INFO, LEAVE = range(5)
TIMEOUT_MS = 20_000


class Menu:
    """step() with each event; chosen becomes the entry's number. lines is what to show."""

    def __init__(self, now_ms):
        self._at = 0
        self._until_ms = ticks_add(now_ms, TIMEOUT_MS)
        self.chosen = None

    @property
    def lines(self):
        return ARROW + ENTRIES[self._at], "next %d/%d hold=ok" % (self._at + 1, len(ENTRIES))

    def step(self, event, now_ms):
        """Take a button event (0, SHORT, LONG)."""
        if event == SHORT:
            self._at = (self._at + 1) % len(ENTRIES)
            self._until_ms = ticks_add(now_ms, TIMEOUT_MS)
        elif event == LONG:
            self.chosen = self._at
        elif ticks_diff(now_ms, self._until_ms) >= 0:
            self.chosen = LEAVE
