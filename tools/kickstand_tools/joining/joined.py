"""A ride with the positions of a track: matched, and written as a log."""

import csv
import gzip
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kickstand.errors import Notice
from kickstand.units import LOST_US

from ..errors import InputError
from ..logs.block import Block
from ..logs.reader import Source, read_blocks, read_twice
from ..logs.source import Progress, name_of
from ..logs.table import Array
from ..output import write_whole
from .match import Match, match
from .motion import motion
from .track import Track
from .track_files import read_track

POSITION = ("lat_deg", "lon_deg", "utc_s")
SPEED = "speed_mps"


@dataclass
class Joined:
    """A ride, the track that belongs to it, and where. own_speed: the log has a speed, which stays."""

    ride: Source
    track: Track
    match: Match
    own_speed: bool
    notices: list[Notice]


def join_track(ride: Source, track: Path | str | Track, progress: Progress | None = None) -> Joined:
    """Find where a phone's or watch's track belongs in a ride, by how both turn and speed up.

    ride: see read_log; it needs neither a calibration nor a speed. track: a .gpx or .fit file. Their clocks may differ by
    any time and drift. progress: called with how much of the ride has been read. Raises InputError where the track is
    another ride's, and where that cannot be told.

    >>> import numpy as np
    >>> from kickstand_tools.api import Log
    >>> still = Log(np.arange(3000) / 50.0, np.tile([0.0, 1.0, 0.0], (3000, 1)), np.zeros((3000, 3)))
    >>> utc_s = 1.7e9 + np.arange(100.0)
    >>> join_track(still, Track(utc_s, np.full(100, 48.0), np.full(100, 11.0), np.zeros(100), "track"))
    Traceback (most recent call last):
    kickstand_tools.errors.InputError: the log, track: the track moves for 0 s only, ...
    """
    given = track if isinstance(track, Track) else read_track(track)
    ride = read_twice(ride)
    notices: list[Notice] = []
    moved = motion(ride, progress, notices)
    try:
        found = match(moved, given)
    except InputError as error:
        raise InputError(f"{name_of(ride)}, {given.name}: {error}") from error
    return Joined(ride, given, found, bool(np.any(np.isfinite(moved.speed_mps))), notices)
