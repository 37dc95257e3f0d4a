"""Rides on the board's flash or an SD card: files of a minute or so, the oldest of which go first.

A file RRRRR-PPPP.ride is part P of ride R. There is always room left for the calibration and for new firmware.
"""

import os
from errno import EEXIST

from .ride_file import BLOCK, block_length

ENOSPC = 28  # which errno lacks on a board
PART_BLOCKS = 16
PART_BYTES = sum(block_length(i) for i in range(PART_BLOCKS))
RESERVE = 64 * BLOCK  # the firmware takes 50 blocks, and flashing keeps each old file until the new one is in
NEEDED = RESERVE + (PART_BLOCKS + 2) * BLOCK  # free before a part is begun; the directory grows, too
ENDING = ".ride"


def directory(settings):
    """Where the rides are: in flash, or on the SD card that config.py names. Raises CardError."""
    if settings.SD_SPI is None:
        return "rides"
    from . import sd_card  # most boards need none of it

    return sd_card.mount(settings) + "/rides"


def free_bytes(path):
    """Of the file system that path is on."""
    space = os.statvfs(path)
    return space[1] * space[3]


class RideRing:
    """settings: a Settings, for where the parts are kept."""

    def __init__(self, settings):
        self._settings = settings
        self._directory = ""
        self._file = None
        self._old = []  # parts that may go, oldest first: (name, bytes)
        self._free = 0

    def begin(self):
        """A new ride; its number. Raises OSError, CardError."""
        self._directory = directory(self._settings)
        try:
            os.mkdir(self._directory)
        except OSError as error:
            if error.args[0] != EEXIST:
                raise
        names = sorted(name for name in os.listdir(self._directory) if name.endswith(ENDING))
        self._old = [(name, os.stat(self._path(name))[6]) for name in names]
        ride = 0
        for name in names:
            if name[:5].isdigit():
                ride = max(ride, int(name[:5]))
        self._ride = ride + 1
        self._part = 0
        self._block = 0  # of the part
        self._free = free_bytes(self._directory)
        self._wrapped = False  # parts of this ride are gone already
        self._others = sum(size for _, size in self._old)
        return self._ride

    def next_length(self):
        """Bytes of the block that is begun now, while the one before may still be written."""
        length = block_length(self._block)
        self._block = (self._block + 1) % PART_BLOCKS
        return length

    def room(self):
        """Bytes until this ride's own beginning has to go."""
        return 0 if self._wrapped else max(0, self._free + self._others - NEEDED)

    def ready(self):
        """True when a block can be written; else one step towards it. Raises OSError."""
        if self._file:
            return True
        if self._free < NEEDED:
            if not self._old:
                raise OSError(ENOSPC)
            name, size = self._old.pop(0)
            os.remove(self._path(name))
            self._free += size
            if name.startswith("%05d" % self._ride):
                self._wrapped = True
            else:
                self._others -= size
            return False
        name = "%05d-%04d%s" % (self._ride, self._part, ENDING)
        self._file = open(self._path(name), "wb")
        self._name, self._size = name, 0
        self._part += 1
        return False

    def write(self, piece):
        """Raises OSError."""
        if self._file.write(piece) != len(piece):
            raise OSError(ENOSPC)
        self._size += len(piece)

    def end_block(self):
        """Power may go from here on. Raises OSError."""
        self._free -= BLOCK
        if self._size < PART_BYTES:
            self._file.flush()
        else:
            self.end()

    def end(self):
        """The end of the ride. Raises OSError."""
        if self._file:
            file, self._file = self._file, None
            self._old.append((self._name, self._size))
            file.close()

    def abandon(self):
        """After an error: whatever can be closed."""
        try:
            self.end()
        except OSError:
            pass

    def name_problem(self, error):
        """At most 16 characters for the display."""
        return "no room" if error.args and error.args[0] == ENOSPC else "flash fault"

    def _path(self, name):
        return self._directory + "/" + name
