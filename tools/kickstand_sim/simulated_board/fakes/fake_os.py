"""MicroPython's `os` with an ilistdir() that also returns sizes, as on a board, and the free space of a Pico's flash.

On MicroPython this module replaces `os`. On CPython the names in ADDED are added to the real `os`.
"""

import os
import sys

if sys.implementation.name == "micropython":
    from os import *  # noqa: F403 # pyright: ignore[reportWildcardImportFromLibrary]

BLOCK = 4096
FLASH_BLOCKS = 352
FIRMWARE_BLOCKS = 80  # flash blocks of the compiled firmware

# Names that CPython's os lacks
ADDED = ("ilistdir",)


def ilistdir(path="."):
    """Yield (name, type, 0, size in bytes) for each entry, and (name, type, 0) for a mounted file system."""
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


def statvfs(path):
    """Return the values of a Pico's flash with the firmware and a folder of the current directory."""
    if path.startswith("/"):
        return os.statvfs(path)
    free = FLASH_BLOCKS - FIRMWARE_BLOCKS - _taken(path)
    return BLOCK, BLOCK, FLASH_BLOCKS, free, free, 0, 0, 0, 0, 255


def _taken(folder):
    blocks = 0
    for name, kind, *rest in ilistdir(folder):
        if kind & 0x4000:
            blocks += _taken(folder + "/" + name)
        elif len(rest) > 1:
            blocks += (rest[1] + BLOCK - 1) // BLOCK
    return blocks
