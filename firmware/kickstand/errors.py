"""What is refused and what has failed: a code, and the numbers that belong to it.

A code is a name for programs, never shown. ui/messages.py words it for the display in 2 x 16 characters, console.py
what a board says on its USB console, and the host's tools word it for a terminal.
"""

import gc
import sys

# What importing machine code raises where there can be none: CPython or a port without viper, an ESP32 that has no free
# memory to run it from, a chip that it was not compiled for.
NO_MACHINE_CODE = (ImportError, NameError, SyntaxError, MemoryError, ValueError)


class Notice:
    """Something to be reported. code: see above; values: its numbers and names, in the order in which the sentences for
    this code use them."""

    def __init__(self, code, *values):
        self.code = code
        self.values = values

    def words(self, table, other=""):
        """The words for this code from a table, with the values filled in. table: text, a line code|words for each
        code. other: the words for a code that is not in the table."""
        start = table.find("\n%s|" % self.code)
        if start >= 0:
            start += len(self.code) + 2
            other = table[start : table.find("\n", start)]
        return other.format(*self.values)


class Refusal(Exception):
    """A request that cannot be carried out, with a code and values like a Notice."""

    def __init__(self, code, *values):
        super().__init__(code, *values)
        self.code = code
        self.values = values

    words = Notice.words


def report(refusal):
    """Print a refusal on the console, unless a print was slow lately: its sentence, or only its code where the module
    with the sentences cannot be loaded (flash or heap has failed)."""
    try:
        from .console import tell

        tell(refusal)
    except (ImportError, OSError, MemoryError):
        print(refusal.code)


def attempt(function, *arguments):
    """tried(), whose Notice is reported."""
    problem = tried(function, *arguments)
    if problem:
        report(problem)
    return problem


def tried(function, *arguments):
    """Call function, which may import modules for the first time. Return None, or a Notice if there is no memory or the
    firmware is incomplete. The modules that it began to import are then removed: MicroPython would keep half of one."""
    before = None
    try:
        before = tuple(sys.modules)
        function(*arguments)
        return None
    except (ImportError, MemoryError) as error:
        for name in [name for name in sys.modules if name not in before] if before else ():
            del sys.modules[name]
        gc.collect()
        return Notice("incomplete" if isinstance(error, ImportError) else "no-memory", str(error))


def checked(machine_code, plain, *arguments):
    """Return the function machine_code, if it gives the same results as the function plain for copies of these
    arguments; else return plain and print that on the console. MicroPython's compilers had errors on some boards."""
    copies = [a if isinstance(a, (int, bytes)) else a[:] for a in arguments]
    if machine_code(*arguments) == plain(*copies) and list(arguments) == copies:
        return machine_code
    report(Notice("wrong-code", plain.__name__))
    return plain


class CaptureError(Refusal):
    """A pose that was not held still, or readings that no still sensor gives."""


class SickSensor(CaptureError):
    """Readings in a pose that only a defective sensor gives."""


class CalibrationError(Refusal):
    """Six-position poses that give no plausible calibration."""


class GyroError(Refusal):
    """A gyro whose rates do not explain how the sensor turned between its poses."""


class AlignmentError(Refusal):
    """Two poses, or a drive, that do not show how the sensor is mounted."""


class StoreError(Refusal):
    """A record that could not be written and read back."""


class CardError(Refusal):
    """No SD card that can be written, or no driver for it."""


class LiveError(Refusal):
    """Why nothing goes to a phone."""


class SettingsError(Refusal):
    """A value in config.py that cannot be used. values[0]: the name of the setting.

    settings: where settings.load() raises it, a Settings with the values that are right, to open the display with."""

    settings = None
