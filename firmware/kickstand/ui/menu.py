"""The menu behind a long press: short for the next entry, long to choose it."""

from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from .pages import ARROW

NAMES = ("Align the bike", "Six positions", "Reset maxima", "Sensor info", "Align by drive", "Record ride")
NAMES += ("Stop recording", "Leave menu")
ALIGN, SIX, RESET, INFO, DRIVE, RECORD, STOP, LEAVE = range(8)
TIMEOUT_MS = 20_000


class Menu:
    """entries: which of those above. step() with each event; chosen becomes one of them. lines is what to show."""

    def __init__(self, entries, now_ms):
        self._entries = entries
        self._at = 0
        self._until_ms = ticks_add(now_ms, TIMEOUT_MS)
        self.chosen = None

    @property
    def lines(self):
        entries = self._entries
        return ARROW + NAMES[entries[self._at]], "next %d/%d hold=ok" % (self._at + 1, len(entries))

    def step(self, event, now_ms):
        """Take a button event (0, SHORT, LONG)."""
        if event == SHORT:
            self._at = (self._at + 1) % len(self._entries)
            self._until_ms = ticks_add(now_ms, TIMEOUT_MS)
        elif event == LONG:
            self.chosen = self._entries[self._at]
        elif ticks_diff(now_ms, self._until_ms) >= 0:
            self.chosen = LEAVE
