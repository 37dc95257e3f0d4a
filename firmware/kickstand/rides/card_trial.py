"""The SD card is mounted, its free space counted, and a file written to it, once and before the watchdog runs.

That takes a fifth of a second. Where the card does not say how much of it is free, all its FAT is read, in half a
minute; where it does not get ready, the driver waits 5 s. During a ride the lean would stand for as long, and the
watchdog would restart the board, again and again.
"""

import os
from errno import EIO

from ..errors import CardError, report
from . import flash_ring, ride_paths

_CONTENT = b"Kickstand"


def prepare(recorder, settings):
    """Raises nothing: what is wrong with the card is reported, as the recorder's problem and when a ride is begun."""
    try:
        _try_out(ride_paths.directory(settings))
        return
    except CardError as error:
        problem = error
    except Exception as error:  # whatever a driver or a file system raises: the board must not restart for it
        problem = CardError("no-card", str(error))
    recorder.problem = recorder.keeper.refused = problem
    report(problem)


def _try_out(directory):
    """Raises CardError, OSError."""
    flash_ring.make(directory)
    flash_ring.free_bytes(directory)
    path = directory + "/probe"
    with open(path, "wb") as file:  # the first file looks for free space, which may read the FAT as well
        file.write(_CONTENT)
    with open(path, "rb") as file:
        if file.read() != _CONTENT:
            raise OSError(EIO)
    os.remove(path)
