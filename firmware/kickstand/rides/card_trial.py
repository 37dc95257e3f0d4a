"""Tests the SD card once, before the watchdog runs. The test mounts the card, counts its free space, and writes a file.

Usually the test takes a fifth of a second. If a card does not store the size of its free space, its whole FAT must be
read, which takes half a minute. If a card does not become ready, the driver waits 5 s. During a ride such a wait would
freeze the lean, and the watchdog would restart the board again and again.
"""

import os
from errno import EIO

from ..errors import CardError, report
from . import flash_ring, ride_paths

_CONTENT = b"Kickstand"


def prepare(recorder, settings):
    """Test the card. Raises nothing. A fault becomes the recorder's `problem`, which is reported when a ride begins."""
    try:
        _try_out(ride_paths.directory(settings))
        return
    except CardError as error:
        problem = error
    except Exception as error:  # catches any error of driver or file system, because the board must not restart
        problem = CardError("no-card", str(error))
    recorder.problem = recorder.keeper.refused = problem
    report(problem)


def _try_out(directory):
    """Write and remove a file on the card. Raises CardError, OSError."""
    flash_ring.make(directory)
    flash_ring.free_bytes(directory)
    path = directory + "/probe"
    with open(path, "wb") as file:  # opening the first file searches for free space and may read the FAT
        file.write(_CONTENT)
    with open(path, "rb") as file:
        if file.read() != _CONTENT:
            raise OSError(EIO)
    os.remove(path)
