"""Errors and notices. Each error and each notice has a code and the values for its sentence.

A code is a name for programs and is never shown. Three modules have words for each code:
* ui/messages.py for the display, in two lines of 16 characters
* console.py for the USB console, in one sentence
* the tools on the computer for a terminal
"""

import gc
import sys


class Notice:
    """Something to report.

    Attributes:
        code: a name for programs.
        values: the numbers and names for the sentence of this code, in the sentence's order.
    """

    def __init__(self, code, *values):
        self.code = code
        self.values = values

    def words(self, table, other=""):
        """Return the words for this code, with the values filled in.

        Args:
            table: a text with one line code|words per code.
            other: the words for a code that is not in the table.
        """
        start = table.find("\n%s|" % self.code)
        if start >= 0:
            start += len(self.code) + 2
            other = table[start : table.find("\n", start)]
        return other.format(*self.values)


class Refusal(Exception):
    """A request was refused. The exception has a code and values like a Notice."""

    def __init__(self, code, *values):
        super().__init__(code, *values)
        self.code = code
        self.values = values

    words = Notice.words


def report(refusal, notices=None):
    """Print a Refusal or Notice on the console, unless a recent print was slow. If the module with the sentences cannot
    be loaded, print only the code.

    Args:
        refusal: the Refusal or Notice.
        notices: App.notices, to show it on the display too, or None.
    """
    if notices is not None:
        notices.append(refusal)
    try:
        from .console import tell

        tell(refusal)
    except (ImportError, OSError, MemoryError):
        print(refusal.code)


def attempt(notices, function, *arguments):
    """Call a function as tried() does. Report its Notice, and return the Notice or None. notices: as for report()."""
    notice = tried(function, *arguments)[1]
    if notice:
        report(notice, notices)
    return notice


def tried(function, *arguments):
    """Call a function that may import modules.

    Returns:
        result: the function's result.
        notice: None, or a Notice if memory is short or the firmware is incomplete.

    After a failure, remove the modules that the function began to import, because MicroPython would keep a
    half-imported module."""
    before = None
    try:
        before = tuple(sys.modules)
        return function(*arguments), None
    except (ImportError, MemoryError) as error:
        for name in [name for name in sys.modules if name not in before] if before else ():
            del sys.modules[name]
        gc.collect()
        return None, Notice("incomplete" if isinstance(error, ImportError) else "no-memory", str(error))


def unload(name):
    """Remove a module of this package that is rarely needed, to free its heap."""
    name = "kickstand." + name
    if sys.modules.pop(name, None):
        folder, _, module = name.rpartition(".")
        delattr(sys.modules[folder], module)


class CaptureError(Refusal):
    """A pose was not still, or its readings cannot come from a still sensor. The rider repeats the pose."""


class SickSensor(CaptureError):
    """Readings can only come from a defective sensor. The console also says so, because the remedy is too long for the
    display."""


class SettingsError(Refusal):
    """A value in config.py cannot be used. values[0] is the name of the setting.

    Attributes:
        settings: a Settings with the valid values, for opening the display. Only settings.load() sets it.
    """

    settings = None
