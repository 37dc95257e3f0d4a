"""Writes rides to the board's flash or an SD card, and removes the oldest rides to make room.

A ride is written in parts: files of about a minute in flash, of a quarter of an hour on a card. RESERVE bytes of the
flash always stay free for the calibration and new firmware.
"""

import os
from errno import EEXIST

from ..units import const
from . import ride_paths
from .block import BLOCK, block_length

_DIRECTORY = 0x4000  # bit in the mode of os.stat() that marks a directory
_ENOSPC = const(28)  # error number for a full disk; MicroPython's errno does not define it
PART_BLOCKS = 16  # number of ride blocks in a part in flash
# Number of ride blocks in a part on a card. A day's ride then takes 85 files. With PART_BLOCKS a day's ride would take
# 1300 files.
_CARD_PART_BLOCKS = const(256)
# Space for the compiled firmware; each file takes whole blocks, and each folder takes two blocks
FIRMWARE = 105 * BLOCK
RESERVE = 66 * BLOCK  # largest free space that an update of compiled firmware needs, plus a margin


def free_bytes(path):
    """Return the number of free bytes in the file system of a path. Raises OSError."""
    space = os.statvfs(path)
    return space[1] * space[3]


def all_bytes(path):
    """Return the size in bytes of the file system of a path. Raises OSError."""
    space = os.statvfs(path)
    return space[1] * space[2]


def make(path):
    """Make a directory unless it exists. Raises OSError, with the number EEXIST if a file has the directory's name."""
    try:
        os.mkdir(path)
    except OSError as error:
        if error.args[0] != EEXIST or not os.stat(path)[0] & _DIRECTORY:
            raise


def _exists(path):
    try:
        os.stat(path)
    except OSError:
        return False
    return True


def _remove_emptied(path):
    """Remove a directory if it is empty. A directory with files of the board's owner stays."""
    try:
        os.rmdir(path)
    except OSError:
        pass


class RideRing:
    """Writes the files of the current ride for a Recorder.

    Call begin() first. For each block call next_length(), ready() until it returns True, write() until the block is
    whole, and end_block(). Call end() last.

    Args:
        settings: a Settings.

    Attributes:
        stops_interrupts: True if interrupts are off during a write, as they are for flash.
        needed: number of bytes that must be free before a part begins.
        refused: None, or the CardError that begin() raises.
    """

    def __init__(self, settings):
        self._settings = settings
        self.stops_interrupts = settings.SD_SPI is None
        self._part_blocks = PART_BLOCKS if settings.SD_SPI is None else _CARD_PART_BLOCKS
        # Two blocks more than the part, because directories grow too
        self.needed = RESERVE + (self._part_blocks + 2) * BLOCK
        self._file = None
        self.refused = None

    def begin(self):
        """Begin a new ride; return its number. Raises OSError, CardError."""
        if self.refused:
            raise self.refused
        self._directory = ride_paths.directory(self._settings)
        make(self._directory)
        self._use(ride_paths.next_ride(self._directory))
        self._part = 0
        self._block = 0  # index of the ride block in its part
        self._free = free_bytes(self._directory)
        # bytes of the earlier rides; this is an estimate, because adding up hundreds of files would take too long
        self._others = max(0, all_bytes(self._directory) - self._free - FIRMWARE)
        self._wrapped = False  # True once parts at the beginning of this ride were removed
        self._oldest = None  # number of the ride whose parts are removed next; None if not found yet
        self._passed = -1  # all rides up to this number have no parts left
        return self._ride

    def _use(self, ride):
        """Make the directory for the parts of this ride. If a file of the board's owner already has the directory's
        name, use a later ride number."""
        while True:
            self._ride = ride
            self._path = ride_paths.ride_path(self._directory, ride)
            try:
                make(ride_paths.group_path(self._directory, ride // ride_paths.RIDES_IN_GROUP))
                make(self._path)
                return
            except OSError as error:
                if error.args[0] != EEXIST or ride + 1 == ride_paths.RIDES_IN_ALL:
                    raise
            ride += 1

    def next_length(self):
        """Return the required length of the ride's next block in bytes. The previous block need not be written yet."""
        length = block_length(self._block)
        self._block = (self._block + 1) % self._part_blocks
        return length

    def room(self):
        """Return the number of bytes that can be recorded before the beginning of this ride is removed."""
        return 0 if self._wrapped else max(0, self._free + self._others - self.needed)

    def ready(self):
        """Return True if a block can be written now. If not, do one step to make writing possible, and return False.
        Raises OSError."""
        if self._file:
            return True
        if self._free < self.needed:
            self._make_room()
        else:
            path = ride_paths.part_path(self._directory, self._ride, self._part)
            self._part += 1
            if _exists(path):  # the existing file may be part of a ride, even if the listing does not show it
                return False
            self._file = open(path, "wb")
            self._left = self._part_blocks
        return False

    def _make_room(self):
        """Do one step of making room: find the oldest ride, or remove its first part or its empty directory. Raises
        OSError."""
        ride = self._oldest
        if ride is None:
            self._oldest = self._find_oldest()
            return
        path = ride_paths.ride_path(self._directory, ride)
        first = ride_paths.first_part(path)
        if first:
            part, size = first
            os.remove(ride_paths.part_path(self._directory, ride, part))
            self._free += size
            if ride == self._ride:
                self._wrapped = True
            else:
                self._others -= size
        elif ride == self._ride:
            raise OSError(_ENOSPC)
        else:
            _remove_emptied(path)
            self._free = free_bytes(self._directory)  # measured again, because in flash a directory takes two blocks
            self._oldest, self._passed = None, ride

    def _find_oldest(self):
        """Return the number of the oldest ride that may have parts, or None if this step has not found it. Raises
        OSError."""
        passed, size = self._passed, ride_paths.RIDES_IN_GROUP
        groups = ride_paths.groups(self._directory)
        group = min((group for group in groups if size * (group + 1) - 1 > passed), default=None)
        if group is None:
            raise OSError(_ENOSPC)
        oldest = min((ride for ride in ride_paths.rides(self._directory, group) if ride > passed), default=None)
        if oldest is None:
            _remove_emptied(ride_paths.group_path(self._directory, group))
            self._passed = size * (group + 1) - 1
        return oldest

    def write(self, data):
        """Write the next bytes of the block. Raises OSError."""
        if self._file.write(data) != len(data):
            raise OSError(_ENOSPC)

    def end_block(self):
        """End a block and flush the file. After that a power cut does not lose the block. Raises OSError."""
        self._free -= BLOCK
        self._left -= 1
        if self._left:
            self._file.flush()
        else:
            self.end()

    def end(self):
        """Close the file of the current part. Raises OSError."""
        if self._file:
            file, self._file = self._file, None
            file.close()

    def abandon(self):
        """Close the ride's open file after an error; ignore an OSError. Completed blocks are kept."""
        try:
            self.end()
        except OSError:
            pass

    def fault_code(self, error):
        """Return the code of the Notice for an OSError or MemoryError that this object raised."""
        if isinstance(error, MemoryError):
            return "out-of-memory"
        if error.args and error.args[0] == _ENOSPC:
            return "out-of-room"
        return "flash-fault" if self._settings.SD_SPI is None else "card-fault"
