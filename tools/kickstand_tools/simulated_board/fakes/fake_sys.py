"""MicroPython's `sys` of a board: what it runs on. All else is the real module's."""

import sys


class _Namespace:
    """What MicroPython takes for a module."""


def posing(port, machine):
    """A module sys. port: its platform.  machine: its implementation._machine, as in chips.MACHINES."""
    module = _Namespace() if sys.implementation.name == "micropython" else type(sys)("sys")
    for name in dir(sys):
        if not name.startswith("__"):
            setattr(module, name, getattr(sys, name))
    module.platform = port
    module.implementation = _Namespace()
    module.implementation.name = sys.implementation.name
    module.implementation.version = sys.implementation.version
    module.implementation._machine = machine
    return module
