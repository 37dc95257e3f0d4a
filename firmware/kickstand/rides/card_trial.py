"""Tries the SD card out, once and before the watchdog runs: mounts it, counts its free space, writes a file.

That takes a fifth of a second. For a card without a count of its free space all of its FAT is read, in half a minute;
for one that does not get ready the driver waits 5 s. During a ride the lean would freeze for as long, and the watchdog
would restart the board again and again.
"""

import os
from errno import EIO

from ..errors import CardError, report
from . import flash_ring, ride_paths

_CONTENT = b"Kickstand"


def prepare(recorder, settings):
    """Try the card out. Raises nothing: a fault becomes the recorder's problem, and is reported when a ride is
    begun."""
    try:
        _try_out(ride_paths.directory(settings))
        return
    except CardError as error:
        problem = error
    except Exception as error:  # whatever a driver or a file system raises: the board must not restart because of it
        problem = CardError("no-card", str(error))
    recorder.problem = recorder.keeper.refused = problem
    report(problem)


def _try_out(directory):
    """Write and remove a file on the card. Raises CardError, OSError."""
    flash_ring.make(directory)
    flash_ring.free_bytes(directory)
    path = directory + "/probe"
    with open(path, "wb") as file:  # the first file looks for free space, which may read the FAT as well
        file.write(_CONTENT)
    with open(path, "rb") as file:
        if file.read() != _CONTENT:
            raise OSError(EIO)
    os.remove(path)
