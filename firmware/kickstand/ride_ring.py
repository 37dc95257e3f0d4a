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
OLDEST = 16  # names kept in memory of parts that may go


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
    """settings: a Settings, for where the parts are kept.  stops_interrupts: while it writes, as flash does."""

    def __init__(self, settings):
        self._settings = settings
        self.stops_interrupts = settings.SD_SPI is None
        self._directory = ""
        self._file = None
        self._old = []  # the next parts to go, oldest first: (name, bytes)
        self._free = 0

    def begin(self):
        """A new ride; its number. Raises OSError, CardError."""
        self._directory = directory(self._settings)
        try:
            os.mkdir(self._directory)
        except OSError as error:
            if error.args[0] != EEXIST:
                raise
        ride = self._others = 0  # bytes
        for name, size in self._find_old():
            self._others += size
            if name[:5].isdigit():
                ride = max(ride, int(name[:5]))
        self._ride = ride + 1
        self._part = 0
        self._block = 0  # of the part
        self._free = free_bytes(self._directory)
        self._wrapped = False  # parts of this ride are gone already
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
                for _ in self._find_old():
                    pass
                if not self._old:
                    raise OSError(ENOSPC)
                return False
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
        self._size = 0
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
            file.close()

    def abandon(self):
        """After an error: whatever can be closed."""
        try:
            self.end()
        except OSError:
            pass

    def name_problem(self, error):
        """At most 16 characters for the display."""
        if isinstance(error, MemoryError):
            return "no memory"
        if error.args and error.args[0] == ENOSPC:
            return "no room"
        return "flash fault" if self._settings.SD_SPI is None else "card fault"

    def _find_old(self):
        """(name, bytes) of each part, which leaves the oldest few in _old. In one pass: to stat each takes a FAT
        a search through the whole directory, and a card has more names than memory has room for."""
        old = self._old = []
        for entry in os.ilistdir(self._directory):
            name, size = entry[0], entry[-1]
            if name.endswith(ENDING):
                old.append((name, size))
                if len(old) == 2 * OLDEST:
                    old.sort()
                    del old[OLDEST:]
                yield name, size
        old.sort()
        del old[OLDEST:]

    def _path(self, name):
        return self._directory + "/" + name
