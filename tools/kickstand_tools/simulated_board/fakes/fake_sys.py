"""MicroPython's `sys` of a board: what it runs on. All else is the real module's. And an ESP32's `esp32`."""

import sys


class _Namespace:
    """What MicroPython takes for a module."""


class Esp32:
    """The module esp32 of a board whose heap has room."""

    HEAP_DATA = 4

    @staticmethod
    def idf_heap_info(capabilities):
        """One region of ESP-IDF's heap: its size, and how much of it is free, in one piece, and at the least."""
        return [(160_000, 0, 0, 0)]


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
