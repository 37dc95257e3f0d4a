"""The simulated board's SD card with MicroPython's own FAT: formatted before a run, read after it."""

# pyright: reportAttributeAccessIssue=false
# the os is MicroPython's

import binascii
import os

MOUNT = "/sd"
READER = "/reader"  # as a computer has it


def format_card(board, plan):
    """With a FAT file system; with "fsinfo" False in the plan nothing says how much of it is free."""
    card = board.card
    os.VfsFat.mkfs(card)
    if not plan.get("fsinfo", True):
        for number in [number for number, content in card.data.items() if content.startswith(b"RRaA")]:
            del card.data[number]
    if plan.get("formatted") is False:
        card.data.clear()
    for at_s, attribute, value in plan.get("card faults", []):
        board.at(at_s, lambda attribute=attribute, value=value: setattr(card, attribute, value))


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
