"""The simulated board's SD card with MicroPython's own FAT: formatted before a run, read after it."""

# pyright: reportAttributeAccessIssue=false
# the os is MicroPython's

import binascii
import os

MOUNT = "/sd"
READER = "/reader"  # as a computer has it


def format_card(card, formatted=True, fsinfo=True):
    """With a FAT file system; without fsinfo nothing says how much of it is free."""
    if formatted:
        os.VfsFat.mkfs(card)
    if not fsinfo:
        for number in [number for number, content in card.data.items() if content.startswith(b"RRaA")]:
            del card.data[number]


def eject():
    """What a reset does: nothing is mounted then."""
    if hasattr(os, "umount") and MOUNT[1:] in os.listdir("/"):
        os.umount(MOUNT)


def rides(board):
    """{path: content in base64} of all files on it, as a computer reads them."""
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
