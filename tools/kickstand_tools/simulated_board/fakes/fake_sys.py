"""MicroPython's `sys` of a board: what it runs on. All else is the real module's."""

import sys


class _Namespace:
    """What MicroPython takes for a module."""


def posing(port, machine):
    """A module sys. port: its platform.  machine: its implementation._machine, as in chips.MACHINES."""
    real = {name: getattr(sys, name) for name in dir(sys) if not name.startswith("__")}
    of = sys.implementation
    implementation = _filled(_Namespace(), {"name": of.name, "version": of.version, "_machine": machine})
    module = _Namespace() if of.name == "micropython" else type(sys)("sys")
    return _filled(_filled(module, real), {"platform": port, "implementation": implementation})


def _filled(made, attributes):
    for name, value in attributes.items():
        setattr(made, name, value)
    return made
