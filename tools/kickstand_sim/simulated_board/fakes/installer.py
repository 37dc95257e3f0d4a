"""Replaces `machine`, `time` and `os` by the fakes, and restores the real modules.

Also replaces `sys` if the board differs from the board that the firmware was imported for.
"""

import os
import sys
import time

from . import fake_bluetooth, fake_machine, fake_os, fake_time

_ADDED_TO = ((time, fake_time), (os, fake_os))  # under CPython


class Installer:
    """Installs the fakes. install() may be called again for another board. uninstall() undoes everything."""

    def __init__(self):
        self._real = {}  # the replaced modules; None for a module that did not exist

    def install(self, board):
        """Replace `machine`, `time` and `os` by the fakes for this simulator.Board."""
        fake_machine.use(board)
        fake_time.use(board.clock, board.clock.now_us)
        self._replace("machine", fake_machine)
        if board.port == "esp32":
            self._replace("esp32", _Esp32)
        if board.radio:
            self._replace("bluetooth", fake_bluetooth)
        if board.poses:
            self._replace("sys", _posing(board.port, board.machine))
        if board.card and board.card.driver:
            from . import sdcard

            self._replace("sdcard", sdcard)
        if sys.implementation.name == "micropython":
            self._replace("time", fake_time)
            self._replace("os", fake_os)
        else:
            from . import cpython  # cpython.py imports modules that MicroPython does not have

            cpython.supplement()
            for real, fake in _ADDED_TO:
                for name in fake.ADDED:
                    setattr(real, name, getattr(fake, name))

    def uninstall(self):
        """Restore the real modules."""
        for name, module in self._real.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module
        self._real = {}
        if sys.implementation.name != "micropython":
            for real, fake in _ADDED_TO:
                for name in fake.ADDED:
                    if hasattr(real, name):
                        delattr(real, name)

    def _replace(self, name, module):
        if name not in self._real:
            self._real[name] = sys.modules.get(name)
        sys.modules[name] = module


class _Namespace:
    """An object that MicroPython accepts as a module."""


class _Esp32:
    """MicroPython's module esp32, on a board with enough free heap."""

    HEAP_DATA = 4

    @staticmethod
    def idf_heap_info(capabilities):
        """Return one region of ESP-IDF's heap as (size, free bytes, largest free block, fewest free bytes)."""
        return [(160_000, 0, 0, 0)]


def _posing(port, machine):
    """Return a module `sys` of another board. port: its platform. machine: its implementation._machine."""
    real = {name: getattr(sys, name) for name in dir(sys) if not name.startswith("__")}
    of = sys.implementation
    implementation = _filled(_Namespace(), {"name": of.name, "version": of.version, "_machine": machine})
    module = _Namespace() if of.name == "micropython" else type(sys)("sys")
    return _filled(_filled(module, real), {"platform": port, "implementation": implementation})


def _filled(module, attributes):
    for name, value in attributes.items():
        setattr(module, name, value)
    return module
