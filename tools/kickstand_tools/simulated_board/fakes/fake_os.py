"""MicroPython's `os` with an ilistdir() that gives sizes, as on a board.

Under MicroPython this module takes the place of `os`; under CPython the names in ADDED are added to the real one.
"""

import os
import sys

if sys.implementation.name == "micropython":
    from os import *  # noqa: F403 # pyright: ignore[reportWildcardImportFromLibrary]

# What CPython's os does not have
ADDED = ("ilistdir",)


def ilistdir(path="."):
    """Yield (name, type, 0, size in bytes) for each entry."""
    for name in os.listdir(path):
        status = os.stat(path + "/" + name)
        yield name, status[0] & 0xF000, 0, status[6]
