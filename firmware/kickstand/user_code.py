"""Runs the owner's code, the file user.py on the board. Updates do not touch this file. The file may define these
functions:

setup(app)                          is called once, before the lean meter runs
page(app), page_battery(app) ...    is called while its page is shown. It returns two lines of 16 characters and, for a
                                    display that draws, optionally a picture, see board/display.py. Each function whose
                                    name begins with page is a page.
on_lean(lean_deg, trusted, meter)   is called ten times per second. While trusted is False the lean must not be used.
on_press(event)                     is called after each press. The event is board.button.SHORT or LONG.

A function is disabled in three cases: it raises, it takes longer than _TOO_SLOW_MS, or _MOST_SLOW successive calls take
longer than _SLOW_MS. A notice on display and console names the disabled function. The import of user.py and setup() may
take any time. A MemoryError in any of these functions disables all of user.py.

This module is imported only if there is a user.py.
"""

import gc
import sys
from time import ticks_diff, ticks_ms

from .errors import Notice, report
from .units import const

_SLOW_MS = const(50)  # a longer call is reported, once for each function
_TOO_SLOW_MS = const(300)  # longest time of a call, because the sensor does not keep its samples for longer
# Number of successive calls longer than _SLOW_MS that disable a function. After more slow calls the loop could not
# catch up with the samples.
_MOST_SLOW = const(5)
_LEAST_FREE = const(20_000)  # smallest free heap in bytes; with less the lean meter would soon fail too
_CALLED = ("setup", "on_lean", "on_press")


def _functions_of(name):
    """Import a module. Return a dictionary of the functions that the firmware calls, with their names as keys. The
    module's code may raise anything."""
    module = __import__(name)
    names = [name for name in dir(module) if name in _CALLED or name.startswith("page")]
    return {name: getattr(module, name) for name in names if callable(getattr(module, name))}


class UserCode:
    """The owner's code for an App.

    Attributes:
        pages: list with one function per page. Such a function takes no arguments and returns the page's lines.
    """

    def __init__(self, app):
        self._app = app
        self._functions = {"import": _functions_of}  # call() also guards the import
        self._slow = {}  # number of slow calls in a row, per function
        # Stored once, because each access to self._draw creates a new bound method. The display would then treat an
        # unchanged picture as a new picture.
        self._drawn = self._draw
        sys.modules.pop("user", None)
        self._functions.update(self.call("import", "user") or {})
        pages = sorted([name for name in self._functions if name.startswith("page")])
        self.pages = [lambda name=name: self._page(name) for name in pages]
        self.call("setup", app)

    def check_memory(self):
        """Disable user.py if it has used up the heap. Call this after gc.collect()."""
        if self._functions and gc.mem_free() < _LEAST_FREE:
            self._forget("memory")

    def call(self, name, *arguments):
        """Call a function of the owner and return its result, or None if it is missing, disabled or fails."""
        function = self._functions.get(name)
        if function is None:
            return None
        begun_ms = ticks_ms()
        try:
            result = function(*arguments)
        except MemoryError:
            return self._forget(name)
        except (Exception, SystemExit) as error:
            sys.print_exception(error)
            return self._leave_out(name, type(error).__name__)
        took_ms = ticks_diff(ticks_ms(), begun_ms)
        if name in ("import", "setup"):
            return result
        count = self._slow.get(name)
        if took_ms <= _SLOW_MS:
            if count:
                self._slow[name] = 0
            return result
        if count is None:
            report(Notice("user-slow", name, took_ms), self._app.notices)
        self._slow[name] = (count or 0) + 1
        if took_ms > _TOO_SLOW_MS or self._slow[name] >= _MOST_SLOW:
            return self._leave_out(name, "%d ms" % took_ms)
        return result

    def _leave_out(self, name, why):
        self._functions.pop(name, None)
        report(Notice("user-failed", name, why), self._app.notices)

    def _forget(self, name):
        """Disable all functions of user.py and free their memory."""
        self._functions = {}
        sys.modules.pop("user", None)
        gc.collect()
        report(Notice("user-memory", name), self._app.notices)

    def _page(self, name):
        shown = self.call(name, self._app)
        if name not in self._functions:
            return "user.py " + name, "left out"
        try:
            line1, line2 = [line if isinstance(line, (str, bytes, bytearray)) else str(line) for line in shown[:2]]
            picture = (self._drawn, name) + tuple(shown[2]) if len(shown) > 2 and shown[2] else None
            return line1, line2, picture
        except Exception:  # the error's own __str__ or __getitem__ may raise anything
            self._leave_out(name, "not two lines")
            return "user.py " + name, "not two lines"

    def _draw(self, canvas, name, draw, *values):
        """Draw the picture of a page with the owner's function. If that function fails, disable the page."""
        self._functions["picture"] = draw
        self.call("picture", canvas, *values)
        if "picture" not in self._functions:
            self._functions.pop(name, None)
