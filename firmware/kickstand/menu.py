"""The menu behind a long press: short for the next entry, long to choose it."""

from time import ticks_add, ticks_diff

from .button import LONG, SHORT
from .pages import ARROW

ENTRIES = ("Align the bike", "Six positions", "Reset maxima", "Sensor info", "Record ride", "Leave menu")
ALIGN, SIX, RESET, INFO, RECORD, LEAVE = range(6)
TIMEOUT_MS = 20_000


class Menu:
    """step() with each event; chosen becomes the entry's number. lines is what to show. recording: a ride is."""

    def __init__(self, now_ms, recording):
        self._recording = recording
        self._at = 0
        self._until_ms = ticks_add(now_ms, TIMEOUT_MS)
        self.chosen = None

    @property
    def lines(self):
        stop = self._recording and self._at == RECORD
        entry = "Stop recording" if stop else ENTRIES[self._at]
        return ARROW + entry, "next %d/%d hold=ok" % (self._at + 1, len(ENTRIES))

    def step(self, event, now_ms):
        """Take a button event (0, SHORT, LONG)."""
        if event == SHORT:
            self._at = (self._at + 1) % len(ENTRIES)
            self._until_ms = ticks_add(now_ms, TIMEOUT_MS)
        elif event == LONG:
            self.chosen = self._at
        elif ticks_diff(now_ms, self._until_ms) >= 0:
            self.chosen = LEAVE
