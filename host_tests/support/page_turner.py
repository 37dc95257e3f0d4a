"""Finds a page of the display by pressing the button. Runs on CPython and MicroPython."""

MOST_PRESSES = 20  # twice the number of pages


class PageTurner:
    """Decides when to press the button, until each wanted view has been shown in turn."""

    def __init__(self):
        self._wanted = []
        self._seen = []  # the view at each press since the search for _wanted[0] began

    def turn_to(self, name):
        """Add a view to the wanted views. The names are in kickstand/ui/pages.py."""
        self._wanted.append(name)

    def presses(self, view):
        """Return True if the button must be pressed now. view: name of the shown view, or None if no app runs."""
        if self._wanted and view == self._wanted[0]:
            self._wanted.pop(0)
            self._seen = []
        if not self._wanted or view is None or len(self._seen) == MOST_PRESSES:
            return False
        self._seen.append(view)
        return True

    def check(self):
        """Raise AssertionError if a wanted view never appeared. The message names the views that appeared."""
        if self._wanted:
            pages = ", ".join(sorted(set(self._seen))) or "nothing"
            raise AssertionError(f"no view {self._wanted[0]} after {len(self._seen)} presses, only: {pages}")
