"""A board's `os`, whose ilistdir() tells the size too: replaces `os` under MicroPython, adds to it under CPython."""

import os
import sys

if sys.implementation.name == "micropython":
    from os import *  # noqa: F403 # pyright: ignore[reportWildcardImportFromLibrary]

# What CPython's lacks
ADDED = ("ilistdir",)


def ilistdir(path="."):
    """(name, type, 0, bytes) of each entry."""
    for name in os.listdir(path):
        status = os.stat(path + "/" + name)
        yield name, status[0] & 0xF000, 0, status[6]
