"""The lean read off the display. Plain Python for CPython and MicroPython."""

import re

_LEAN_PAGE = re.compile("Lean +([0-9]+)° (left|right)?[ *]*$")


def shown_lean(lcd):
    """The lean that the two lines of a display show, in degrees, > 0 to the right; None if they show something else."""
    found = _LEAN_PAGE.match(lcd[0])
    if not found:
        return None
    return -float(found.group(1)) if found.group(2) == "left" else float(found.group(1))
