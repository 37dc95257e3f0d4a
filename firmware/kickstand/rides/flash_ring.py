"""Rides on the board's flash or an SD card: files of a minute or some more, the oldest of which go first.

Part 2 of ride 345 is the file 003/45/00002.rid: a FAT reads a directory from its beginning for each name, so each is
kept small, and its names are of a kind (8.3) that takes one entry. There is always room left for the calibration and
for new firmware.
"""

import os
from errno import EEXIST

from .block import BLOCK, block_length

ENOSPC = 28  # which errno lacks on a board
PART_BLOCKS = 16
CARD_PART_BLOCKS = 256  # a day is 85 parts, not 1300
FIRMWARE = 80 * BLOCK  # compiled: each of its files takes whole blocks, each folder two
RESERVE = 72 * BLOCK  # what an update needs at most: sources in place of smaller, compiled modules
GROUP = 100  # rides in a directory
GROUP_DIGITS = 3
RIDE_DIGITS = 2
PART_DIGITS = 5
ENDING = ".rid"


def directory(settings):
    """Where the rides are: in flash, or on the SD card that config.py names. Raises CardError."""
    if settings.SD_SPI is None:
        return "rides"
    from ..board import sd_card  # most boards need none of it

    return sd_card.mount(settings) + "/rides"


def free_bytes(path):
    """Of the file system that path is on."""
    space = os.statvfs(path)
    return space[1] * space[3]


def all_bytes(path):
    """Free or not, of the file system that path is on."""
    space = os.statvfs(path)
    return space[1] * space[2]


def group_path(directory, group):
    """Of the rides whose numbers begin so."""
    return "%s/%03d" % (directory, group)


def ride_path(directory, ride):
    """Where the parts of a ride are."""
    return "%s/%02d" % (group_path(directory, ride // GROUP), ride % GROUP)


def part_path(directory, ride, part):
    """The file."""
    return "%s/%05d%s" % (ride_path(directory, ride), part, ENDING)


def parts(directory):
    """(ride, part, bytes) of every part that there is. A ride takes 5 ms in flash, 20 on a card."""
    for group, _ in _numbers(directory, GROUP_DIGITS):
        for ride, _ in _numbers(group_path(directory, group), RIDE_DIGITS):
            ride += GROUP * group
            for part, size in _numbers(ride_path(directory, ride), PART_DIGITS, ENDING):
                yield ride, part, size


def _numbers(path, digits, ending=""):
    """(number, bytes) of each file whose name is so many digits and the ending; without one, of each directory.
    Whatever else is there is not ours."""
    kind = 0x8000 if ending else 0x4000
    for entry in os.ilistdir(path):
        name = entry[0]
        if entry[1] == kind and len(name) == digits + len(ending) and name.endswith(ending):
            if name[:digits].isdigit():
                yield int(name[:digits]), entry[-1]


def _newest(directory):
    """The number of the newest ride; 0: none."""
    newest = max(_numbers(directory, GROUP_DIGITS), default=None)
    if newest is None:
        return 0
    return GROUP * newest[0] + max(_numbers(group_path(directory, newest[0]), RIDE_DIGITS), default=(0, 0))[0]


def _first(path):
    """(number, bytes) of the first part in a ride's directory; None: it has no part."""
    return min(_numbers(path, PART_DIGITS, ENDING), default=None)


def _make(path):
    """A directory, unless it is there."""
    try:
        os.mkdir(path)
    except OSError as error:
        if error.args[0] != EEXIST:
            raise


def _remove_emptied(path):
    """A directory, unless its owner has put something into it."""
    try:
        os.rmdir(path)
    except OSError:
        pass


class RideRing:
    """settings: a Settings, for where the parts are kept.  stops_interrupts: while it writes, as flash does.
    needed: bytes that are free before a part is begun."""

    def __init__(self, settings):
        self._settings = settings
        self.stops_interrupts = settings.SD_SPI is None
        self._part_blocks = PART_BLOCKS if settings.SD_SPI is None else CARD_PART_BLOCKS
        self.needed = RESERVE + (self._part_blocks + 2) * BLOCK  # a directory grows, too
        self._directory = ""
        self._file = None
        self._free = 0

    def begin(self):
        """A new ride; its number. Raises OSError, CardError."""
        self._directory = directory(self._settings)
        _make(self._directory)
        self._use(_newest(self._directory) or 1)
        if _first(self._path):  # else the power went before its first block
            self._use(self._ride + 1)
        self._part = 0
        self._block = 0  # of the part
        self._free = free_bytes(self._directory)
        # bytes of the rides before, nearly: to count them takes too long where there are hundreds
        self._others = max(0, all_bytes(self._directory) - self._free - FIRMWARE)
        self._wrapped = False  # parts of this ride are gone already
        self._oldest = None  # the ride whose parts go next, when it is known
        self._passed = -1  # the last ride that has nothing more to go
        return self._ride

    def _use(self, ride):
        self._ride = ride
        self._path = ride_path(self._directory, ride)
        _make(group_path(self._directory, ride // GROUP))
        _make(self._path)

    def next_length(self):
        """Bytes of the block that is begun now, while the one before may still be written."""
        length = block_length(self._block)
        self._block = (self._block + 1) % self._part_blocks
        return length

    def room(self):
        """Bytes until this ride's own beginning has to go."""
        return 0 if self._wrapped else max(0, self._free + self._others - self.needed)

    def ready(self):
        """True when a block can be written; else one step towards it. Raises OSError."""
        if self._file:
            return True
        if self._free < self.needed:
            self._make_room()
        else:
            self._file = open(part_path(self._directory, self._ride, self._part), "wb")
            self._part += 1
            self._left = self._part_blocks
        return False

    def _make_room(self):
        """One step: find the oldest ride, remove its first part, or the directory that is left. Raises OSError."""
        ride = self._oldest
        if ride is None:
            self._oldest = self._find_oldest()
            return
        path = ride_path(self._directory, ride)
        first = _first(path)
        if first:
            part, size = first
            os.remove(part_path(self._directory, ride, part))
            self._free += size
            if ride == self._ride:
                self._wrapped = True
            else:
                self._others -= size
        elif ride == self._ride:
            raise OSError(ENOSPC)
        else:
            _remove_emptied(path)
            self._free = free_bytes(self._directory)  # in flash a directory takes as much as two blocks
            self._oldest, self._passed = None, ride

    def _find_oldest(self):
        """The oldest ride that is not passed. None: not found in this step."""
        groups = (group for group, _ in _numbers(self._directory, GROUP_DIGITS))
        group = min((group for group in groups if GROUP * (group + 1) - 1 > self._passed), default=None)
        if group is None:
            raise OSError(ENOSPC)
        path = group_path(self._directory, group)
        rides = (GROUP * group + ride for ride, _ in _numbers(path, RIDE_DIGITS))
        oldest = min((ride for ride in rides if ride > self._passed), default=None)
        if oldest is None:
            _remove_emptied(path)
            self._passed = GROUP * (group + 1) - 1
        return oldest

    def write(self, piece):
        """Raises OSError."""
        if self._file.write(piece) != len(piece):
            raise OSError(ENOSPC)

    def end_block(self):
        """Power may go from here on. Raises OSError."""
        self._free -= BLOCK
        self._left -= 1
        if self._left:
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

    def fault_code(self, error):
        """The code of the RecordingError for an OSError or MemoryError that came from here."""
        if isinstance(error, MemoryError):
            return "out-of-memory"
        if error.args and error.args[0] == ENOSPC:
            return "out-of-room"
        return "flash-fault" if self._settings.SD_SPI is None else "card-fault"
