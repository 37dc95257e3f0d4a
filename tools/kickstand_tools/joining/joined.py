"""Joins a track's positions to a ride, and writes the result as a log."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from kickstand.units import LOST_US

from ..checks.log import check_log
from ..common.messages import InputError, Message
from ..common.output import write_packed
from ..logs.csv_lines import write_log
from ..logs.log import Log, Source
from ..logs.reader import read_log, text_rows
from ..logs.source import File, Progress, name_of
from ..signals import Array, Ints
from .match import Match, match
from .motion import motion
from .track import Track
from .track_files import read_track

SPEED = "speed_mps"
_FORMAT = {SPEED: "%.3f", "lat_deg": "%.7f", "lon_deg": "%.7f", "utc_s": "%.3f"}


@dataclass
class Joined:
    """A ride, its track, and their Match.

    own_speed: True if the log already has a speed. Then this speed is kept.
    """

    ride: File | Log
    track: Track
    match: Match
    own_speed: bool
    notices: list[Message]

    @property
    def columns(self) -> dict[str, Array]:
        """Return the track's values by the names of the log's columns, each of shape (m)."""
        track = self.track
        values = {SPEED: track.speeds_mps(), "lat_deg": track.lat_deg, "lon_deg": track.lon_deg, "utc_s": track.utc_s}
        return {name: value for name, value in values.items() if name != SPEED or not self.own_speed}


def join_track(ride: Source, track: Path | str | Track, progress: Progress | None = None) -> Joined:
    """Find the time of a phone's or watch's track in a ride, from the yaw and the acceleration of ride and track.

    ride: see read_log; it needs neither a calibration nor a speed. track: a .gpx or .fit file. The clocks of ride and
    track may differ by any time, and drift. progress: called with (done, total) of the ride's bytes. Raises InputError
    if the track is another ride's, or if the match is not certain.

    >>> from kickstand_tools.api import simulate_ride
    >>> ride = simulate_ride("hills", seed=1, seconds=120.0)
    >>> course = np.cumsum(np.radians(ride.truth["yaw_rate_dps"])) / ride.rate_hz  # to the left of east
    >>> north, east = (np.cumsum(ride.truth["speed_mps"] * way(course)) / ride.rate_hz for way in (np.sin, np.cos))
    >>> lat, lon = np.degrees(north / 6_371_000.0)[::200], np.degrees(east / 6_371_000.0)[::200]
    >>> track = Track(1.7e9 + np.arange(len(lat)), lat, lon, np.full(len(lat), np.nan), "track")
    >>> joined = join_track(Log.from_readings(ride.readings, ride.rate_hz), track)
    >>> round(joined.match.start_utc_s - 1.7e9)
    0
    """
    track = track if isinstance(track, Track) else read_track(track)
    checked = check_log(read_log(ride, progress=progress))
    moved = motion(checked)
    if moved.has_positions:
        raise InputError(f"{name_of(ride)} has positions already: join adds positions to a ride without any")
    try:
        best = match(moved, track)
    except InputError as error:
        raise InputError(f"{name_of(ride)}, {track.name}: {error}") from error
    # The lines of a file are written again. An open file has been read, and a stretch is written as a log.
    source = ride if isinstance(ride, (Path, str)) else checked.log
    return Joined(source, track, best, moved.has_speed, checked.notices)


def write_joined(out: Path | str, joined: Joined, progress: Progress | None = None) -> int:
    """Write the lines of the ride, with the track's values in the nearest rows. The file is written whole or not at
    all.

    It is gzipped if its name ends in .gz. Returns the number of positions written. progress: called with (done, total)
    of the ride. Raises InputError.

    >>> import tempfile
    >>> log = Log([0.0, 0.01], [[0.0, 1.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2)
    >>> track = Track(*(np.array([value]) for value in (1.7e9, 48.0, 11.0, 9.0)), name="track")
    >>> joined = Joined(log, track, Match(1.7e9, 0.0, 0.1, 0.9, 0.0), own_speed=False, notices=[])
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     count = write_joined(f"{directory}/ride.csv", joined)
    ...     print(Path(f"{directory}/ride.csv").read_text().splitlines()[1].partition(",0.000000,9")[2])
    .000,48.0000000,11.0000000,1700000000.000
    """
    out, columns, log = Path(out), joined.columns, read_log(joined.ride)
    rows, points = _nearest(log.time_us, np.rint(joined.match.ride_s(joined.track.utc_s) * 1e6).astype(np.int64))
    if not isinstance(joined.ride, (Path, str)):
        values = {name: _placed(column[points], rows, len(log.t_s)) for name, column in columns.items()}
        write_log(out, replace(log, **values))
        return len(points)
    ends = {}
    for row, values in zip(rows.tolist(), zip(*(column[points].tolist() for column in columns.values()))):
        ends[row] = ",".join([_FORMAT[name] % value for name, value in zip(columns, values)]).replace("nan", "")
    write_packed(out, _lines(joined.ride, list(columns), len(log.t_s), ends, progress))
    return len(points)


def _lines(
    file: Path | str, columns: list[str], count: int, ends: dict[int, str], progress: Progress | None
) -> Iterator[bytes]:
    """Yield the lines of a log with the new columns at their end.

    count: number of samples.
    ends: the cells of the new columns, by the number of the sample.
    """
    begin, empty = 0, "," * (len(columns) - 1)
    for names, lines in text_rows(file, progress):
        own = [k for k, name in enumerate(names) if name not in columns]
        if not begin:
            yield (",".join([*(names[k] for k in own), *columns]) + "\n").encode()
        lines = lines[: count - begin]  # without a last row that was cut
        if len(own) < len(names):
            cells = (next(csv.reader([line])) if '"' in line else line.split(",") for line in lines)
            lines = [",".join([row[k] for k in own]) for row in cells]
        yield "".join([f"{line},{ends.get(k, empty)}\n" for k, line in enumerate(lines, begin)]).encode()
        begin += len(lines)


def _nearest(time_us: Ints, at_us: Ints) -> tuple[Ints, Ints]:
    """Rows, and the index of the point for each. Only points within the log's time, and not in a gap, are used."""
    points = np.flatnonzero((at_us >= time_us[0]) & (at_us <= time_us[-1]))
    following = np.clip(np.searchsorted(time_us, at_us[points]), 1, max(len(time_us) - 1, 1))
    if len(time_us) < 2:
        return np.zeros(len(points), dtype=int), points
    rows = following - (at_us[points] - time_us[following - 1] < time_us[following] - at_us[points])
    near = np.abs(time_us[rows] - at_us[points]) <= LOST_US
    rows, last = np.unique(rows[near][::-1], return_index=True)  # if a row has two points, use the later point
    return rows, points[near][::-1][last]


def _placed(values: Array, rows: Ints, count: int) -> Array:
    placed = np.full(count, np.nan)
    placed[rows] = values
    return placed
