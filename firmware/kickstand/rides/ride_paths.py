"""The files of rides: part 2 of ride 345 is the file 003/45/00002.rid in the directory of the rides.

FAT searches a directory from its beginning, so each directory is kept small: 100 rides form a group, and each ride has
its own directory. Names in the form 8.3 take one directory entry each.
"""

import os

RIDES_IN_GROUP = 100
RIDES_IN_ALL = 100_000  # ride numbers stay below this: a group of four digits would not be found again
_GROUP_DIGITS = 3
_RIDE_DIGITS = 2
_PART_DIGITS = 5
_ENDING = ".rid"
_DIRECTORY, _FILE = 0x4000, 0x8000  # types of os.ilistdir()'s entries


def directory(settings):
    """The directory of the rides: in flash, or on the SD card if one is set in config.py. Raises CardError."""
    if settings.SD_SPI is None:
        return "rides"
    from ..board import sd_card  # imported here, because most boards do not need it

    return sd_card.mount(settings) + "/rides"


def group_path(directory, group):
    """The directory of the rides group * 100 to group * 100 + 99."""
    return "%s/%03d" % (directory, group)


def ride_path(directory, ride):
    """The directory of a ride's parts."""
    return "%s/%02d" % (group_path(directory, ride // RIDES_IN_GROUP), ride % RIDES_IN_GROUP)


def part_path(directory, ride, part):
    """The file of a part."""
    return "%s/%05d%s" % (ride_path(directory, ride), part, _ENDING)


def groups(directory):
    """The numbers of all groups, in any order. Raises OSError."""
    for group, _ in _numbers(directory, _GROUP_DIGITS):
        yield group


def rides(directory, group):
    """The numbers of all rides in a group, in any order. Raises OSError."""
    for ride, _ in _numbers(group_path(directory, group), _RIDE_DIGITS):
        yield RIDES_IN_GROUP * group + ride


def first_part(ride_directory):
    """The first part in a ride's directory as (part, bytes), or None. Raises OSError."""
    return min(_numbers(ride_directory, _PART_DIGITS, _ENDING), default=None)


def newest_ride(directory, below=RIDES_IN_ALL):
    """The number of the newest ride with a part and a number below this one; 0 without such a ride. Raises OSError.

    A directory without parts does not count: the board's owner may have created it."""
    while True:
        group = max((n for n in groups(directory) if RIDES_IN_GROUP * n < below), default=None)
        if group is None:
            return 0
        ride = max((n for n in rides(directory, group) if n < below), default=None)
        if ride is None:
            below = RIDES_IN_GROUP * group
        elif first_part(ride_path(directory, ride)):
            return ride
        else:
            below = ride


def next_ride(directory):
    """The number for a new ride: the newest plus one. Raises OSError.

    If a directory already has the largest possible number, the new ride gets a number below it. No recording reaches
    that number."""
    below = RIDES_IN_ALL
    while True:
        newest = newest_ride(directory, below)
        if newest + 1 < below:
            return newest + 1
        below = newest


def parts(directory):
    """Return (ride, part, bytes) of every part, in any order. Takes 5 ms per ride in flash, 20 ms on a card. Raises
    OSError."""
    for group in groups(directory):
        for ride in rides(directory, group):
            for part, size in _numbers(ride_path(directory, ride), _PART_DIGITS, _ENDING):
                yield ride, part, size


def _numbers(path, digits, ending=""):
    """Return (number, bytes) of each file in path with a name of this many digits and this ending. Without an ending,
    return those of directories. Other files belong to the board's owner and are ignored."""
    kind = _FILE if ending else _DIRECTORY
    for entry in os.ilistdir(path):
        name = entry[0]
        if entry[1] == kind and len(name) == digits + len(ending) and name.endswith(ending):
            if name[:digits].isdigit():
                yield int(name[:digits]), entry[-1]
