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
    """Yield (name, type, 0, size in bytes) for each entry, and (name, type, 0) for what is mounted."""
    mounted = []
    if path == "/" and hasattr(os, "mount"):
        listed = os.ilistdir(path)  # pyright: ignore[reportAttributeAccessIssue]
        mounted = [entry for entry in listed if len(entry) == 3 and entry[2] == 0]
        yield from mounted
    for name in os.listdir(path):
        if any(entry[0] == name for entry in mounted):
            continue
        status = os.stat(path + "/" + name)
        yield name, status[0] & 0xF000, 0, status[6]
