"""Puts the fakes in the place of `machine`, `time` and `os`, and puts the real modules back."""

import os
import sys
import time

from . import current, fake_machine, fake_os, fake_sys, fake_time

_ADDED_TO = ((time, fake_time), (os, fake_os))  # under CPython


class Installer:
    """install() may be called again, for another board; uninstall() undoes all of it."""

    def __init__(self):
        self._real = {}  # the modules that were replaced; None where there was none

    def install(self, board):
        """From now on `machine`, `time` and `os` are those of this simulator.Board."""
        current.use(board)
        fake_time.use(board.clock, board.clock.now_us)
        self._replace("machine", fake_machine)
        if board.port == "esp32":
            self._replace("esp32", fake_sys.Esp32)
        if board.poses:
            self._replace("sys", fake_sys.posing(board.port, board.machine))
        if board.card and board.card.driver:
            from . import sdcard

            self._replace("sdcard", sdcard)
        if sys.implementation.name == "micropython":
            self._replace("time", fake_time)
            self._replace("os", fake_os)
        else:
            from . import cpython  # imports modules that MicroPython does not have

            cpython.supplement()
            for real, fake in _ADDED_TO:
                for name in fake.ADDED:
                    setattr(real, name, getattr(fake, name))

    def uninstall(self):
        """Put the real modules back."""
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
