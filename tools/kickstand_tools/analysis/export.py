"""Writes a ride in the format of another program, or with Kickstand's own columns as CSV or Apache Parquet.

The own columns are the calibrated log in the vehicle's axes, and the lean that the display shows. In Parquet, the
metadata of each field has its unit.

GPX 1.1, https://www.topografix.com/GPX/1/1/: each position of the log becomes a track point. The speed is in Garmin's
TrackPointExtension, https://www8.garmin.com/xmlschemas/TrackPointExtensionv2.xsd. A lean that the meter trusts, > 0 to
the right, is in Kickstand's own element.

CSV v3 is the table that RaceChrono exports. The file has metadata, a blank line, and three heading lines: names, units,
and sources. A cell is empty if its source has no new value. Names and units are those of RaceChrono's own files: see
https://github.com/ClassicMiniDIY/UltraLog/pull/85, https://apexlog.io/blog/what-to-do-with-racechrono-data, and
https://racechrono.com/article/2572 (acc in G, gyro in deg/s). As there, lateral_acc is positive in a left turn, and
longitudinal_acc when speeding up.

VBO is Racelogic's, which Circuit Tools opens and RaceChrono imports. Sections and standard channels follow
https://developers.racelogic.co.uk/Portal/Tutorials/tutorialVBOfilestructure.html. All other channels have units.
Columns and signs follow https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format and the user guide
of the VBOX HD Lite: time HHMMSS.SS; velocity in km/h; latitude and longitude in minutes, north and west positive;
heading in degrees clockwise from north; long accel positive forward, lat accel positive to the left. A log does not
contain the number of satellites. The file says 4, which a position needs, or 0 without a position. VBO requires a
velocity. If the log has no speed, it is 0, and a comment in the file says so.
"""

import gzip
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ..common.installation import extra
from ..common.messages import InputError, Message, kind
from ..common.output import whole_file
from ..logs.csv_text import csv_lines
from ..logs.log import float_schema
from ..logs.source import Progress
from ..signals import Array, distance_m
from .ride import GAP_S, Channels, Ride, downsampled, rounded_to, track

if TYPE_CHECKING:
    from gpxpy.gpx import GPXTrackPoint

GARMIN = "http://www.garmin.com/xmlschemas/TrackPointExtension/v2"
KICKSTAND = "urn:kickstand"
_NOTE = "Made by Kickstand. lean_angle > 0 to the right; x left, y up, z forward"
# Each column has name, unit, source, digits, and value. The value is time_s or a channel; "" for an empty cell.
RACECHRONO = (
    ("timestamp", "unix time", "", 3, "time_s"),
    ("fragment_id", "", "", 0, "zero"),
    ("lap_number", "", "", 0, ""),
    ("elapsed_time", "s", "", 3, "t_s"),
    ("latitude", "deg", "100: gps", 7, "lat_deg"),
    ("longitude", "deg", "100: gps", 7, "lon_deg"),
    ("speed", "m/s", "100: gps", 3, "speed_mps"),
    ("lateral_acc", "G", "calc", 4, "lateral_g"),
    ("lean_angle", "deg", "calc", 2, "lean_deg"),
    ("longitudinal_acc", "G", "calc", 4, "forward_g"),
    ("x_acc", "G", "101: acc", 4, "left_g"),
    ("y_acc", "G", "101: acc", 4, "up_g"),
    ("z_acc", "G", "101: acc", 4, "forward_g"),
    ("x_rate_of_rotation", "deg/s", "102: gyro", 3, "left_dps"),
    ("y_rate_of_rotation", "deg/s", "102: gyro", 3, "yaw_rate_dps"),
    ("z_rate_of_rotation", "deg/s", "102: gyro", 3, "roll_rate_dps"),
)
# A standard channel has a title in [header], and a name in [column names].
STANDARD = (
    ("satellites", "sats"),
    ("time", "time"),
    ("latitude", "lat"),
    ("longitude", "long"),
    ("velocity kmh", "velocity"),
    ("heading", "heading"),
    ("height", "height"),
    ("long accel g", "longacc"),
    ("lat accel g", "latacc"),
)
# Each other channel has a title, a unit, and the name of the channel of a ride.
OTHER = (
    ("lean-angle", "deg", "lean_deg"),
    ("yaw-rate", "deg/s", "yaw_rate_dps"),
    ("roll-rate", "deg/s", "roll_rate_dps"),
    ("temperature", "C", "temp_c"),
)
_STANDARD_ROW = "%03d %09.2f %+013.6f %+013.6f %07.3f %06.2f +00000.00 %+07.3f %+07.3f"
_SATELLITES = 4
_SAME_M = 1e-3  # a larger movement between two rows, which are 0.01 s apart, gives a new heading

STEP_S = {"csv": 0.0, "gpx": 0.0, "parquet": 0.0, "racechrono": 0.001, "vbo": 0.01}  # resolution of the time
_NEEDS = {"gpx": ("GPX", "gpxpy"), "parquet": ("Parquet", "pyarrow")}  # name and library of a format
_DATED = ("gpx", "racechrono", "vbo")  # formats that need date and time
_CLOCK_S = 1e8  # a time in a log is Unix time if it is larger than this (March 1973)

# Number of decimals and unit of each column.
COLUMNS = {
    "t_s": (6, "s"),
    "lean_deg": (3, "deg"),
    "lean_formula_deg": (3, "deg"),
    "left_g": (5, "g"),
    "up_g": (5, "g"),
    "forward_g": (5, "g"),
    "lateral_g": (5, "g"),
    "pitch_rate_dps": (4, "deg/s"),
    "yaw_rate_dps": (4, "deg/s"),
    "roll_rate_dps": (4, "deg/s"),
    "speed_mps": (3, "m/s"),
    "temp_c": (2, "Cel"),
    "shown_g": (5, "g"),
    "lean_sigma_deg": (3, "deg"),
    "lat_deg": (7, "deg"),
    "lon_deg": (7, "deg"),
    "utc_s": (3, "s"),
}

_FINE = ("t_s", "lat_deg", "lon_deg", "utc_s")  # 64-bit floats, because a 32-bit float resolves positions only to 1 m


def write_gpx(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write GPX. After a gap, a new segment begins.

    start_s: Universal Time of the log's first sample, for positions without a time.
    """
    from gpxpy.gpx import GPX, GPXTrack, GPXTrackSegment

    gpx, track = GPX(), GPXTrack(name="Ride")
    gpx.creator = "Kickstand"
    gpx.nsmap |= {"gpxtpx": GARMIN, "kickstand": KICKSTAND}
    gpx.tracks.append(track)
    last_s = -np.inf
    for block in blocks:
        lean_deg = np.where(block.trusted, block.lean_deg, np.nan)
        utc_s = np.where(np.isfinite(block.utc_s), block.utc_s, start_s + block.t_s)
        columns = (block.t_s, block.lat_deg, block.lon_deg, utc_s, block.speed_mps, lean_deg)
        for t, *values in np.column_stack(columns).tolist():
            if t - last_s > GAP_S:
                track.segments.append(GPXTrackSegment())
            track.segments[-1].points.append(_point(*values))
            last_s = t
    path.write_text(gpx.to_xml(version="1.1"), encoding="utf-8")


def _point(lat_deg: float, lon_deg: float, utc_s: float, speed_mps: float, lean_deg: float) -> "GPXTrackPoint":
    from gpxpy.gpx import GPXTrackPoint

    point = GPXTrackPoint(lat_deg, lon_deg, time=datetime.fromtimestamp(round(utc_s, 3), UTC))
    if speed_mps == speed_mps:  # not NaN
        garmin = Element(f"{{{GARMIN}}}TrackPointExtension")
        SubElement(garmin, f"{{{GARMIN}}}speed").text = f"{speed_mps:.2f}"
        point.extensions.append(garmin)
    if lean_deg == lean_deg:
        lean = Element(f"{{{KICKSTAND}}}lean_deg")
        lean.text = f"{lean_deg:.1f}"
        point.extensions.append(lean)
    return point


def write_racechrono(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write RaceChrono's CSV v3. start_s: Unix time of the first row."""
    head = [
        "This file is created using RaceChrono CSV v3 by Kickstand.",
        "Format,3",
        'Session title,"Ride"',
        "Session type,Lap timing",
        "Track name,",
        "Driver name,",
        time.strftime("Created,%d/%m/%Y,%H:%M", time.gmtime(start_s)),
        f'Note,"{_NOTE}"',
        "",
    ]
    names, units, sources, digits, row_values = zip(*RACECHRONO)
    head += [",".join(line) for line in (names, units, sources)]
    with open(path, "wb") as file:
        file.write(("\n".join(head) + "\n").encode())
        for block in blocks:
            count = len(block.t_s)
            values = vars(block) | {"zero": np.zeros(count), "": np.full(count, np.nan)}
            values |= {"time_s": block.t_s + start_s, "left_dps": -block.pitch_rate_dps}
            table = np.column_stack([values[value] for value in row_values])
            file.writelines(csv_lines(table, digits))


def write_vbo(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write VBO. Lines end in CR and LF. Date and times are UTC.

    blocks: at least one block. They should have positions in as many rows as possible. A channel that is NaN in the
        whole first block is left out of the file.
    start_s: time of the log's t_s = 0, in s since 1970.
    """
    first = next(blocks)  # the first block shows which channels the log has; a missing channel is NaN in all blocks
    extra_columns = [
        (name, unit, channel) for name, unit, channel in OTHER if not np.all(np.isnan(getattr(first, channel)))
    ]
    lean = "lean-angle in degrees, > 0 to the right; " if OTHER[0] in extra_columns else ""
    satellites = f"satellites {_SATELLITES} stands for a position, 0 for none"
    comments = [f"Kickstand: {lean}{satellites}", "Log Rate (Hz) : at most 100.00"]
    if np.all(np.isnan(first.speed_mps)):
        comments.append("no speed in the log: velocity 0 stands for none")
    row_form = _STANDARD_ROW + " %+.6E" * len(extra_columns) + "\r\n"
    head = [
        time.strftime("File created on %d/%m/%Y at %H:%M:%S", time.gmtime(start_s)),
        "",
        "[header]",
        *[title for title, _ in STANDARD],
        *[name for name, _, _ in extra_columns],
        "",
        "[channel units]",
        *[unit for _, unit, _ in extra_columns],
        "",
        "[comments]",
        *comments,
        "",
        "[column names]",
        " ".join([name for _, name in STANDARD] + [name for name, _, _ in extra_columns]),
        "",
        "[data]",
    ]
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write("\r\n".join(head) + "\r\n")
        course_deg = _Heading()
        for block in chain([first], blocks):
            placed = np.isfinite(block.lat_deg)
            table = np.column_stack(
                (
                    placed * _SATELLITES,
                    _clock(block.t_s + start_s),
                    60.0 * block.lat_deg,
                    -60.0 * block.lon_deg,
                    block.speed_mps * 3.6,
                    course_deg.of(block.lat_deg, block.lon_deg),
                    block.forward_g,
                    block.lateral_g,
                    *[getattr(block, channel) for _, _, channel in extra_columns],
                )
            )
            file.write("".join([row_form % tuple(row) for row in np.nan_to_num(table).tolist()]))


class _Heading:
    """Computes headings from positions, block by block."""

    def __init__(self) -> None:
        self._last = np.full((3, 1), np.nan)  # latitude, longitude and heading of the last row of the previous block

    def of(self, lat_deg: Array, lon_deg: Array) -> Array:
        """Return the heading from the previous row to each row, in degrees clockwise from north.

        If two rows have the same position, the heading of the previous row is kept. The first row with a position has
        the heading of the second row.
        """
        lat, lon = (np.concatenate((last, now)) for last, now in zip(self._last, (lat_deg, lon_deg)))
        east, north = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
        heading = np.concatenate((self._last[2], np.degrees(np.arctan2(east, north)) % 360.0))
        # A distance of NaN counts as a movement, because a gap ends the track.
        moved = np.concatenate(([True], ~(np.hypot(east, north) <= _SAME_M)))
        heading = heading[np.maximum.accumulate(np.where(moved, np.arange(len(heading)), 0))]
        first = np.flatnonzero(np.isnan(heading[:-1]) & np.isfinite(lat[:-1]))
        heading[first] = heading[first + 1]
        self._last = np.array([[lat[-1]], [lon[-1]], [heading[-1]]])
        return heading[1:]


def _clock(seconds: np.ndarray) -> np.ndarray:
    """Convert seconds to the time of day, as the number HHMMSS.SS."""
    hundredths = np.rint(seconds * 100.0).astype(np.int64) % (86400 * 100)
    full_s, part = np.divmod(hundredths, 100)
    return (full_s // 3600) * 10000 + (full_s // 60 % 60) * 100 + full_s % 60 + part / 100.0


RowsShare = kind(
    "rows-share",
    "samples rows step_s",
    "this format holds times to {step_s:g} s: {samples} samples became {rows} rows, those with the same time their "
    "mean",
)


def write_csv(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    opened = gzip.open if path.suffix == ".gz" else open
    digits = [digit for digit, _ in COLUMNS.values()]
    with opened(path, "wb") as file:
        file.write((",".join(COLUMNS) + "\n").encode("ascii"))
        for block in blocks:
            block.t_s = block.t_s + start_s
            file.writelines(csv_lines(np.column_stack([getattr(block, name) for name in COLUMNS]), digits))


def write_parquet(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write Parquet, one row group per block."""
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    about = {"made_by": "kickstand", "axes": "left, up, forward; lean > 0 to the right"}
    schema = float_schema({name: unit for name, (_, unit) in COLUMNS.items()}, _FINE, about)
    with ParquetWriter(path, schema) as writer:
        for block in blocks:
            block.t_s = block.t_s + start_s
            columns = [pyarrow.array(getattr(block, field.name), type=field.type) for field in schema]
            writer.write_table(pyarrow.table(columns, schema=schema))


_WRITE: dict[str, Callable[[Path, Iterator[Channels], float], None]] = {
    "csv": write_csv,
    "gpx": write_gpx,
    "parquet": write_parquet,
    "racechrono": write_racechrono,
    "vbo": write_vbo,
}


def export(ride: Ride, form: str, out: Path | str, progress: Progress | None = None) -> int:
    """Write a ride of open_ride() to a file. Returns the number of rows. See export_with_notices().

    >>> import tempfile
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     export(open_ride(log, CalibrationFile(aligned=True)), "csv", f"{directory}/ride.csv")
    300
    """
    return export_with_notices(ride, form, out, progress)[0]


def export_with_notices(
    ride: Ride, form: str, out: Path | str, progress: Progress | None = None
) -> tuple[int, list[Message]]:
    """Write a ride of open_ride() to a file. After an error, no incomplete file remains.

    The format gpx needs positions. The formats gpx, racechrono and vbo need date and time, which a satellite receiver
    gives. A board without a receiver has no clock. Its ride is assumed to end when the log's file was last written.

    form: "csv" (gzipped if `out` ends in .gz), "gpx", "parquet", "racechrono" or "vbo".
    Returns the number of rows, and remarks about the log. Raises InputError.
    """
    name, library = _NEEDS.get(form, ("", ""))
    if library and not find_spec(library):
        raise InputError(f"{name} needs {library}: " + extra("rides"))
    log, positions = ride.log, track(ride.log)
    if form == "gpx" and not len(positions.t_s):
        raise InputError(f"{ride.name} has no positions (lat_deg, lon_deg), so there is no track to write")
    start_s, step_s = _start_s(ride, form), STEP_S[form]
    has_speed = ~np.isnan(log.speed_mps)
    count = sample_count = 0
    reading = ride.read(progress)

    def measured() -> Iterator[Channels]:
        nonlocal sample_count
        for part in reading.parts():
            sample_count += len(part.t_s)
            yield part

    def rows() -> Iterator[Channels]:
        """Yield the rows of the file in blocks, with the values that this format needs."""
        nonlocal count
        for part in downsampled(measured(), step_s, rounded=True) if step_s else measured():
            if form == "gpx":
                part = part.part(np.isfinite(part.lat_deg) & np.isfinite(part.lon_deg))
            if form in ("gpx", "vbo") and np.any(has_speed):
                # Every row of a VBO file needs a speed. Without interpolation, rows between two speeds would have a
                # speed of 0.
                part.speed_mps = np.interp(part.t_s, log.t_s[has_speed], log.speed_mps[has_speed])
            if form == "vbo":
                part.lat_deg, part.lon_deg = positions.at(part.t_s)
            part.lean_sigma_deg = np.where(part.trusted, part.lean_sigma_deg, np.nan)  # as in the output of `replay`
            if step_s:
                part.t_s = rounded_to(part.t_s, step_s)
            count += len(part.t_s)
            yield part

    with whole_file(Path(out)) as temporary:
        _WRITE[form](temporary, rows(), start_s)
    shared = [RowsShare(sample_count, count, step_s)] if step_s and count < sample_count else []
    return count, [*reading.notices(), *shared]


def _start_s(ride: Ride, form: str) -> float:
    """Return the time of the log's t_s = 0 in the file: in s since 1970 for the formats with a date."""
    start_s, start_utc_s = ride.log.start_s, ride.log.start_utc_s
    if form in _DATED and start_utc_s is not None:
        start_s = start_utc_s
    elif form in _DATED and start_s < _CLOCK_S:
        file = Path(ride.name)
        written_s = file.stat().st_mtime if file.is_file() else time.time()
        start_s = float(max(0, int(written_s - ride.log.t_s[-1])))
    # Start and times are both rounded, so that different times stay different
    return round(start_s / STEP_S[form]) * STEP_S[form] if STEP_S[form] else start_s
