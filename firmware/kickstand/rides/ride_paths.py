"""Names and finds the files of rides. Part 2 of ride 345 is the file 003/45/00002.rid in the directory of the rides.

FAT searches a directory from its beginning, so each directory is kept small. 100 rides form a group, and each ride has
its own directory. Names have at most 8 characters and an extension of 3, so that each takes one directory entry.
"""

import os

RIDES_IN_GROUP = 100
RIDES_IN_ALL = 100_000  # limit of the ride numbers, because a group must have three digits
_GROUP_DIGITS = 3
_RIDE_DIGITS = 2
_PART_DIGITS = 5
_ENDING = ".rid"
_DIRECTORY, _FILE = 0x4000, 0x8000  # the types of entries that os.ilistdir() returns


def directory(settings):
    """Return the directory of the rides, in flash or on the SD card that config.py names. Raises CardError."""
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


def groups(directory):
    """Yield the numbers of all groups, in any order. Raises OSError."""
    for group, _ in _numbers(directory, _GROUP_DIGITS):
        yield group


def rides(directory, group):
    """Yield the numbers of all rides in a group, in any order. Raises OSError."""
    for ride, _ in _numbers(group_path(directory, group), _RIDE_DIGITS):
        yield RIDES_IN_GROUP * group + ride


def first_part(ride_directory):
    """Return the first part in a ride's directory as (part number, bytes), or None. Raises OSError."""
    return min(_numbers(ride_directory, _PART_DIGITS, _ENDING), default=None)


def newest_ride(directory, below=RIDES_IN_ALL):
    """Return the number of the newest ride below the number `below`, or 0 if there is no ride. Raises OSError.

    A directory without parts does not count as a ride, because the board's owner may have created it."""
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
    """Return the number for a new ride, which is the newest number plus one. Raises OSError.

    No recording reaches the largest possible number, but a directory of the board's owner may have this number. In this
    case the new ride gets a smaller, free number."""
    below = RIDES_IN_ALL
    while True:
        newest = newest_ride(directory, below)
        if newest + 1 < below:
            return newest + 1
        below = newest


def parts(directory):
    """Yield (ride, part, bytes) of every part, in any order. Listing takes 5 ms per ride in flash, and 20 ms on a card.
    Raises OSError."""
    for group in groups(directory):
        for ride in rides(directory, group):
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
