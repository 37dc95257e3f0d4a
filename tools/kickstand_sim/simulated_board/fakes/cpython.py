"""Adds to CPython MicroPython's modules `micropython` and `framebuf`, sys.print_exception, and functions of gc."""

import gc
import sys
import traceback
import types

from . import framebuf


def supplement():
    """Add the features. Drivers and app need these features. The firmware's mathematics does not."""
    sys.modules.setdefault("micropython", _module())
    sys.modules.setdefault("framebuf", framebuf)
    if not hasattr(sys, "print_exception"):
        setattr(sys, "print_exception", _print_exception)  # noqa: B010 type checkers know no such attribute
    if not hasattr(gc, "threshold"):
        setattr(gc, "threshold", lambda amount: None)  # noqa: B010 likewise
        setattr(gc, "mem_free", lambda: 120_000)  # noqa: B010 likewise


def _print_exception(error, file=None):
    traceback.print_exception(error, file=file)


def _module():
    module = types.ModuleType("micropython")
    for name in ("const", "native"):
        setattr(module, name, lambda x: x)
    setattr(module, "viper", _no_viper)  # noqa: B010 likewise
    setattr(module, "alloc_emergency_exception_buf", lambda size: None)  # noqa: B010 likewise
    return module


def _no_viper(function):
    """Raise NameError, as up to Python 3.13 the annotations of viper functions do."""
    raise NameError("CPython has no machine code")
