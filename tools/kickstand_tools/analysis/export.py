"""Writes a ride in the format of another program, or with Kickstand's own columns as CSV or Apache Parquet.

The own columns are the calibrated log in the vehicle's axes, and the lean that the display shows. In Parquet, the
metadata of each field has its unit. pandas.read_parquet opens the file: https://arrow.apache.org/docs/python/parquet.html
"""

import gzip
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ..common.installation import extra
from ..common.messages import InputError, Message, kind
from ..common.output import whole_file
from ..logs.csv_lines import csv_lines
from ..logs.log import float_schema
from ..logs.source import Progress
from .channels import Channels, downsampled, rounded_to, track
from .export_formats import write_gpx, write_racechrono, write_vbo
from .ride import Ride

STEP_S = {"csv": 0.0, "gpx": 0.0, "parquet": 0.0, "racechrono": 0.001, "vbo": 0.01}  # resolution of the time
_NEEDS = {"gpx": ("GPX", "gpxpy"), "parquet": ("Parquet", "pyarrow")}  # name and library of a format
_DATED = ("gpx", "racechrono", "vbo")  # formats that need date and time
_CLOCK_S = 1e8  # a time in a log is Unix time if it is larger than this (March 1973)


RowsShare = kind(
    "rows-share",
    "samples rows step_s",
    "this format holds times to {step_s:g} s: {samples} samples became {rows} rows, those with the same time their "
    "mean",
)

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


def write_csv(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write CSV, gzipped if the name ends in .gz."""
    opened = gzip.open if path.suffix == ".gz" else open
    digits = [digit for digit, _ in COLUMNS.values()]
    with opened(path, "wb") as file:
        file.write((",".join(COLUMNS) + "\n").encode("ascii"))
        for block in blocks:
            block.t_s = block.t_s + start_s
            file.writelines(csv_lines(np.column_stack([getattr(block, name) for name in COLUMNS]), digits))


def write_parquet(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write Parquet, one row group per block.

    Times and positions are 64-bit floats, all other columns 32-bit floats. A missing value is NaN.
    """
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
    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log, open_ride
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
    progress: called with (done, total) of the log's samples.
    Returns the number of rows, and remarks about the log. Raises InputError.
    """
    name, library = _NEEDS.get(form, ("", ""))
    if library and not find_spec(library):
        raise InputError(f"{name} needs {library}: " + extra("rides"))
    log, positions = ride.log, track(ride.log)
    has_speed = ~np.isnan(log.speed_mps)
    if form == "gpx" and not len(positions.t_s):
        raise InputError(f"{ride.name} has no positions (lat_deg, lon_deg), so there is no track to write")
    start_s = log.start_s
    if form in _DATED and log.start_utc_s is not None:
        start_s = log.start_utc_s
    elif form in _DATED and start_s < _CLOCK_S:
        file = Path(ride.name)
        written_s = file.stat().st_mtime if file.is_file() else time.time()
        start_s = float(max(0, int(written_s - log.t_s[-1])))
    step_s = STEP_S[form]
    if step_s:  # start and times are both rounded, so that different times stay different
        start_s = round(start_s / step_s) * step_s
    count = sample_count = 0
    reading = ride.read(progress)

    def measured() -> Iterator[Channels]:
        nonlocal sample_count
        for part in reading.parts():
            sample_count += len(part.t_s)
            yield part

    def rows() -> Iterator[Channels]:
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
