"""The menu, which a long press opens. In the menu a short press shows the next entry, and a long press chooses the
entry."""

from time import ticks_add, ticks_diff

from ..board.button import SHORT
from ..units import const
from .pages import ARROW

_TIMEOUT_MS = const(20_000)


class Menu:
    """The open menu.

    Args:
        entries: tuple of (name, function) per entry. The name has at most 15 characters. The function is called as
            function(now_ms) when the rider chooses the entry.
        now_ms: ticks_ms().
    """

    name = "menu"

    def __init__(self, entries, now_ms):
        self._entries = entries + (("Leave menu", None),)
        self._at = 0
        self._until_ms = ticks_add(now_ms, _TIMEOUT_MS)
        self.ended = False

    @property
    def entry(self):
        """The name of the entry that is shown."""
        return self._entries[self._at][0]

    def lines(self, now_ms):
        if ticks_diff(now_ms, self._until_ms) >= 0:
            self.ended = True
            return None
        return ARROW + self.entry, "next %d/%d hold=ok" % (self._at + 1, len(self._entries))

    def press(self, event, now_ms):
        if event == SHORT:
            self._at = (self._at + 1) % len(self._entries)
            self._until_ms = ticks_add(now_ms, _TIMEOUT_MS)
            return True
        self.ended = True
        action = self._entries[self._at][1]
        if action:
            action(now_ms)
        return True
