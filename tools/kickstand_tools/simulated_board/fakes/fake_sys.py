"""MicroPython's `sys` of a board: what it runs on. All else is the real module's."""

import sys


class Implementation:
    """sys.implementation. machine: as chips.MACHINES."""

    def __init__(self, machine):
        self.name = sys.implementation.name
        self.version = sys.implementation.version
        self._machine = machine


class Sys:
    """The module. port: its platform."""

    def __init__(self, port, machine):
        for name in dir(sys):
            if name not in ("__class__", "__dict__", "__doc__"):
                setattr(self, name, getattr(sys, name))
        self.platform = port
        self.implementation = Implementation(machine)
