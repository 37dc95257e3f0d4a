"""The files of rides, in flash or on an SD card: their names, writing a ride, and making room for it.

Part 2 of ride 345 is the file 003/45/00002.rid in the directory of the rides. FAT searches a directory from its
beginning, so each directory is kept small. 100 rides form a group, and each ride has its own directory. Names have at
most 8 characters and an extension of 3, so that each takes one directory entry.

A part is a file of about a minute in flash, of a quarter of an hour on a card. RESERVE bytes of the flash always stay
free for the calibration and new firmware.
"""

import os
from errno import EEXIST, EIO

from ..errors import Refusal, report
from ..units import const
from .block import BLOCK, block_length

RIDES_IN_GROUP = 100
RIDES_IN_ALL = 100_000  # limit of the ride numbers, because a group must have three digits
_GROUP_DIGITS = 3
_RIDE_DIGITS = 2
_PART_DIGITS = 5
_ENDING = ".rid"
_CONTENT = b"Kickstand"  # of the file that tests a card
_DIRECTORY, _FILE = 0x4000, 0x8000  # the types of entries that os.ilistdir() returns
_ENOSPC = const(28)  # error number for a full disk; MicroPython's errno does not define it
PART_BLOCKS = 16  # number of ride blocks in a part in flash
# Number of ride blocks in a part on a card. A day's ride then takes 85 files. With PART_BLOCKS a day's ride would take
# 1300 files.
_CARD_PART_BLOCKS = const(256)
# Space for the compiled firmware; each file takes whole blocks, and each folder takes two blocks
FIRMWARE = 90 * BLOCK
RESERVE = 66 * BLOCK  # largest free space that an update of compiled firmware needs, plus a margin


def directory(settings):
    """Return the directory of the rides, in flash or on the SD card that config.py names. Raises Refusal."""
    if settings.SD_SPI is None:
        return "rides"
    from ..board import sd_card  # imported here, because most boards do not need it

    return sd_card.mount(settings) + "/rides"


def group_path(directory, group):
    """Return the directory of the rides from group * 100 to group * 100 + 99."""
    return "%s/%03d" % (directory, group)


def ride_path(directory, ride):
    """Return the directory of a ride's parts."""
    return "%s/%02d" % (group_path(directory, ride // RIDES_IN_GROUP), ride % RIDES_IN_GROUP)


def part_path(directory, ride, part):
    """Return the path of a part's file."""
    return "%s/%05d%s" % (ride_path(directory, ride), part, _ENDING)


def first_part(ride_directory):
    """Return the first part in a ride's directory as (part number, bytes), or None. Raises OSError."""
    return min(_numbers(ride_directory, _PART_DIGITS, _ENDING), default=None)


def rides(directory, newest_first=False):
    """Yield the numbers of all rides, in their order. Raises OSError.

    A ride may have no parts, because the board's owner may have created its directory."""
    for group, _ in sorted(_numbers(directory, _GROUP_DIGITS), reverse=newest_first):
        for ride, _ in sorted(_numbers(group_path(directory, group), _RIDE_DIGITS), reverse=newest_first):
            yield RIDES_IN_GROUP * group + ride


def next_ride(directory):
    """Return the number for a new ride, which is the newest number plus one. Raises OSError.

    No recording reaches the largest possible number, but a directory of the board's owner may have this number. In this
    case the new ride gets a smaller, free number."""
    below = RIDES_IN_ALL
    for ride in rides(directory, True):
        if first_part(ride_path(directory, ride)):
            if ride + 1 < below:
                break
            below = ride
    else:
        ride = 0
    return ride + 1


def parts(directory):
    """Yield (ride, part, bytes) of every part, in any order. Listing takes 5 ms per ride in flash, and 20 ms on a card.
    Raises OSError."""
    for ride in rides(directory):
        for part, size in _numbers(ride_path(directory, ride), _PART_DIGITS, _ENDING):
            yield ride, part, size


def _numbers(path, digits, ending=""):
    """Yield (number, bytes) of each file whose name is a number with this many digits, followed by the ending.

    Without an ending, directories are listed instead of files. Other files belong to the board's owner and are
    ignored."""
    kind = _FILE if ending else _DIRECTORY
    for entry in os.ilistdir(path):
        name = entry[0]
        if entry[1] == kind and len(name) == digits + len(ending) and name.endswith(ending):
            if name[:digits].isdigit():
                yield int(name[:digits]), entry[-1]


def _space(path):
    """Return the number of free bytes and of all bytes in the file system of a path. Raises OSError."""
    space = os.statvfs(path)
    return space[1] * space[3], space[1] * space[2]


def _make(path):
    """Make a directory unless it exists. Raises OSError, with the number EEXIST if a file has the directory's name."""
    try:
        os.mkdir(path)
    except OSError as error:
        if error.args[0] != EEXIST or not os.stat(path)[0] & _DIRECTORY:
            raise


def _succeeds(function, *arguments):
    """Call a function. Return False if it raises OSError, as os.stat() without a file, or os.rmdir() of a directory
    with files of the board's owner."""
    try:
        function(*arguments)
        return True
    except OSError:
        return False


def _has_data(path):
    """Return True if a path has a directory, or a file that is not empty. Ctrl-C may leave an empty part."""
    try:
        status = os.stat(path)
        return bool(status[0] & _DIRECTORY or status[6])
    except OSError:
        return False


def _test_card(path):
    """Write and remove a file in a directory of the card. Raises OSError."""
    _make(path)
    _space(path)
    path += "/probe"
    with open(path, "wb") as file:  # opening the first file searches for free space and may read the FAT
        file.write(_CONTENT)
    with open(path, "rb") as file:
        if file.read() != _CONTENT:
            raise OSError(EIO)
    os.remove(path)


class RideFiles:
    """Writes the files of the current ride for a Recorder.

    Call begin() first. For each block call next_length(), ready() until it returns True, write() until the block is
    whole, and end_block(). Call again() before a block is written a second time, after Ctrl-C. Call end() last.

    Args:
        settings: a Settings.

    Attributes:
        stops_interrupts: True if interrupts are off during a write, as they are for flash.
        needed: number of bytes that must be free before a part begins.
    """

    def __init__(self, settings):
        self._settings = settings
        self.stops_interrupts = settings.SD_SPI is None
        self._part_blocks = PART_BLOCKS if self.stops_interrupts else _CARD_PART_BLOCKS
        # Two blocks more than the part, because directories grow too
        self.needed = RESERVE + (self._part_blocks + 2) * BLOCK
        self._file = None
        self._refused = None  # the Refusal that begin() raises

    def prepare(self, notices):
        """Make the first ride's directory in flash, because an ESP32 makes a directory so slowly that the first
        readings would be lost. Or test the SD card: mount it, count its free space, and write a file.

        Usually the test takes a fifth of a second. If a card does not store the size of its free space, its whole FAT
        must be read, which takes half a minute. If a card does not become ready, the driver waits 5 s. During a ride
        such a wait would freeze the lean, and the watchdog would restart the board again and again.

        Args:
            notices: list to which a Refusal is appended if the card cannot be used.
        """
        try:
            if self.stops_interrupts:
                self.begin()
            else:
                _test_card(directory(self._settings))
        except Exception as error:  # any error of driver or file system, because the board must not restart
            if not self.stops_interrupts:  # begin() reports an error of the flash when the ride begins
                self._refused = error if isinstance(error, Refusal) else Refusal("no-card", str(error))
                report(self._refused, notices)

    def begin(self):
        """Begin a new ride; return its number. Raises OSError, Refusal."""
        if self._refused:
            raise self._refused
        self._directory = directory(self._settings)
        _make(self._directory)
        self._use(next_ride(self._directory))
        self._part = 0
        self._block = 0  # index of the ride block in its part
        self._free, size = _space(self._directory)
        # bytes of the earlier rides; this is an estimate, because adding up hundreds of files would take too long
        self._others = max(0, size - self._free - FIRMWARE)
        self._wrapped = False  # True once parts at the beginning of this ride were removed
        self._removing = self._make_room()
        return self._ride

    def _use(self, ride):
        """Make the directory for the parts of this ride. If a file of the board's owner already has the directory's
        name, use a later ride number."""
        while True:
            self._ride = ride
            try:
                _make(group_path(self._directory, ride // RIDES_IN_GROUP))
                _make(ride_path(self._directory, ride))
                return
            except OSError as error:
                if error.args[0] != EEXIST or ride + 1 == RIDES_IN_ALL:
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
            next(self._removing)
        else:
            path = part_path(self._directory, self._ride, self._part)
            if not _has_data(path):  # the file may be part of a ride, even if the listing does not show it
                self._left, self._start = self._part_blocks, 0
                self._file = open(path, "wb")
            self._part += 1
        return False

    def _make_room(self):
        """Remove the oldest rides, part by part. This generator does one step at a time: it finds a ride, or removes a
        part or an empty directory. Raises OSError."""
        group = 0
        for ride in rides(self._directory):
            while group < ride // RIDES_IN_GROUP:
                _succeeds(os.rmdir, group_path(self._directory, group))
                group += 1
            yield
            path = ride_path(self._directory, ride)
            while True:
                first = first_part(path)
                if not first:
                    break
                part, size = first
                os.remove(part_path(self._directory, ride, part))
                self._free += size
                if ride == self._ride:
                    self._wrapped = True
                else:
                    self._others -= size
                yield
            if ride == self._ride:
                break
            _succeeds(os.rmdir, path)
            self._free = _space(self._directory)[0]  # measured again, because in flash a directory takes two blocks
            yield
        raise OSError(_ENOSPC)

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
            self._start = self._file.tell()
        else:
            self.end()

    def again(self):
        """Go back to the beginning of a block whose writing was interrupted. Raises OSError."""
        if self._file:
            self._file.seek(self._start)

    def end(self):
        """Close the file of the current part. Raises OSError."""
        if self._file:
            file, self._file = self._file, None
            file.close()

    def abandon(self):
        """Close the ride's open file after an error; ignore an OSError. Completed blocks are kept."""
        _succeeds(self.end)

    def fault_code(self, error):
        """Return the code of the Notice for an OSError or MemoryError that this object raised."""
        if isinstance(error, MemoryError):
            return "out-of-memory"
        if error.args and error.args[0] == _ENOSPC:
            return "out-of-room"
        return "flash-fault" if self.stops_interrupts else "card-fault"
