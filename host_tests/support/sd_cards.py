"""Formats the simulated board's SD card before a run and reads it afterwards, with MicroPython's own FAT."""

# pyright: reportAttributeAccessIssue=false
# os is MicroPython's module

import binascii
import os

MOUNT = "/sd"
READER = "/reader"  # as a computer has it


def format_card(card, formatted=True, fsinfo=True):
    """Format the card with FAT. fsinfo: False to leave out the count of free clusters."""
    if formatted:
        os.VfsFat.mkfs(card)
    if not fsinfo:
        for number in [number for number, content in card.data.items() if content.startswith(b"RRaA")]:
            del card.data[number]


def eject():
    """Unmount everything, as a reset does."""
    if hasattr(os, "umount") and MOUNT[1:] in os.listdir("/"):
        os.umount(MOUNT)


def rides(board):
    """Return {path: content in base64} of all files on the card, as a computer reads them."""
    found = {}
    try:
        os.mount(os.VfsFat(board.card), READER)
    except OSError:
        return None
    _collect(READER, found)
    os.umount(READER)
    return found


def _collect(folder, found):
    for entry in os.ilistdir(folder):
        path = folder + "/" + entry[0]
        if entry[1] & 0x4000:
            _collect(path, found)
        else:
            with open(path, "rb") as file:
                found[path[len(READER) :]] = binascii.b2a_base64(file.read()).decode()
