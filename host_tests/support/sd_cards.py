"""Reads the simulated board's SD card after a run, with MicroPython's own FAT."""

# pyright: reportAttributeAccessIssue=false
# Only MicroPython's os has a FAT, so only a run on MicroPython can have a card.

import binascii
import os

MOUNT = "/sd"
READER = "/reader"  # the folder on which a computer would mount the card


def eject():
    """Unmount the card, as a reset does."""
    if hasattr(os, "umount") and MOUNT[1:] in os.listdir("/"):
        os.umount(MOUNT)


def rides(board):
    """Return {path: content in base64} of all files on the card, as a computer reads them."""
    contents = {}
    try:
        os.mount(os.VfsFat(board.card), READER)
    except OSError:
        return None
    _collect(READER, contents)
    os.umount(READER)
    return contents


def _collect(folder, found):
    for entry in os.ilistdir(folder):
        path = folder + "/" + entry[0]
        if entry[1] & 0x4000:
            _collect(path, found)
        else:
            with open(path, "rb") as file:
                found[path[len(READER) :]] = binascii.b2a_base64(file.read()).decode()
