"""Writes a ride in the format of another program."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ...common.errors import InputError, extra
from ...common.messages import Message
from ...common.output import whole_file
from ...logs.log import Stretch
from ...logs.reader import Source, read_blocks, read_twice
from ...logs.source import Progress
from ...signals import Array
from ..channels import Channels, downsampled, rounded_to
from ..ride import Ride
from ..track import LogTrack, joined, track
from . import export_columns, export_gpx, export_racechrono, export_vbo

STEP_S = {"csv": 0.0, "gpx": 0.0, "parquet": 0.0, "racechrono": 0.001, "vbo": 0.01}  # resolution of the time
_WRITE: dict[str, Callable[[Path, Iterator[Channels], float], None]] = {
    "csv": export_columns.write_csv,
    "gpx": export_gpx.write,
    "parquet": export_columns.write_parquet,
    "racechrono": export_racechrono.write,
    "vbo": export_vbo.write,
}
_NEEDS = {"gpx": ("GPX", "gpxpy"), "parquet": ("Parquet", "pyarrow")}  # name and library of a format
_DATED = ("gpx", "racechrono", "vbo")  # formats that need date and time
_CLOCK_S = 1e8  # a time in a log is Unix time if it is larger than this (March 1973)


class RowsShare(Message):
    """Several samples have the same time in the format."""

    samples: int
    rows: int
    step_s: float

    code = "rows-share"
    text = (
        "this format holds times to {step_s:g} s: {samples} samples became {rows} rows, those with the same time their "
        "mean"
    )


def export(
    ride: Ride, form: str, out: Path | str, progress: Progress | None = None, notices: list[Message] | None = None
) -> int:
    """Write a ride of open_ride() to a file. After an error, no incomplete file remains.

    The format gpx needs positions. The formats gpx, racechrono and vbo need date and time, which a satellite receiver
    gives. A board without a receiver has no clock. Its ride is assumed to end when the log's file was last written.

    form: "csv" (gzipped if `out` ends in .gz), "gpx", "parquet", "racechrono" or "vbo".
    progress: called with (done, total) of the log.
    notices: remarks about the log are appended to this list.
    Returns the number of rows. Raises InputError.

    >>> import tempfile
    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log, open_ride
    >>> log = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)))
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     export(open_ride(log, CalibrationFile(aligned=True)), "csv", f"{directory}/ride.csv")
    300
    """
    name, library = _NEEDS.get(form, ("", ""))
    if library and not find_spec(library):
        raise InputError(f"{name} needs {library}: " + extra("rides"))
    ride = replace(ride, log=read_twice(ride.log))
    log = ride.log.source if isinstance(ride.log, Stretch) else ride.log
    extent = _first_pass(log)
    start_s = extent.start_s
    if form == "gpx" and not len(extent.places.t_s):
        raise InputError(f"{ride.name} has no positions (lat_deg, lon_deg), so there is no track to write")
    if form in _DATED and extent.utc_s is not None:
        start_s = extent.utc_s
    elif form in _DATED and start_s < _CLOCK_S:
        written_s = Path(log).stat().st_mtime if isinstance(log, (Path, str)) else time.time()
        start_s = float(max(0, int(written_s - extent.seconds)))
    step_s = STEP_S[form]
    if step_s:  # start and times are both rounded, so that different times stay different
        start_s = round(start_s / step_s) * step_s
    count = sample_count = 0

    def measured() -> Iterator[Channels]:
        nonlocal sample_count
        for block in ride.blocks(progress, notices):
            sample_count += len(block.t_s)
            yield block

    def rows() -> Iterator[Channels]:
        nonlocal count
        for block in downsampled(measured(), step_s, rounded=True) if step_s else measured():
            if form == "gpx":
                block = block.part(np.isfinite(block.lat_deg) & np.isfinite(block.lon_deg))
            if form in ("gpx", "vbo") and len(extent.speeds):
                # Every row of a VBO file needs a speed. Without interpolation, rows between two speeds would have a
                # speed of 0.
                block.speed_mps = np.interp(block.t_s, *extent.speeds.T)
            if form == "vbo":
                block.lat_deg, block.lon_deg = extent.places.at(block.t_s)
            block.lean_sigma_deg = np.where(block.trusted, block.lean_sigma_deg, np.nan)  # as in the output of `replay`
            if step_s:
                block.t_s = rounded_to(block.t_s, step_s)
            count += len(block.t_s)
            yield block

    with whole_file(Path(out)) as temporary:
        _WRITE[form](temporary, rows(), start_s)
    if notices is not None and step_s and count < sample_count:
        notices.append(RowsShare(sample_count, count, step_s))
    return count


@dataclass
class _Extent:
    """The data that the first pass finds in a log.

    start_s: time of the first sample, in the log's own time.
    seconds: duration of the log.
    speeds: time since the first sample in s, and speed in m/s, shape (n, 2).
    places: the positions.
    utc_s: Universal Time of the first sample; None if unknown. The median over the rows is used, because some values
        are late.
    """

    start_s: float
    seconds: float
    speeds: Array
    places: LogTrack
    utc_s: float | None


def _first_pass(log: Source) -> _Extent:
    start_s, seconds, speeds, tracks, starts_utc_s = 0.0, 0.0, [], [], []
    for block in read_blocks(log, lines=False):
        start_s, seconds = block.start_s, float(block.t_s[-1])
        valid = ~np.isnan(block.speed_mps)
        speeds.append(np.column_stack((block.t_s[valid], block.speed_mps[valid])))
        tracks.append(track(block))
        starts_utc_s.append((block.utc_s - block.t_s)[np.isfinite(block.utc_s)])
    offsets_s = np.concatenate(starts_utc_s)
    utc_s = float(np.median(offsets_s)) if len(offsets_s) else None
    return _Extent(start_s, seconds, np.concatenate(speeds), joined(tracks), utc_s)
