"""A ride in the files of other programs."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ...logs.reader import read_blocks
from ...output import write_whole
from ..channels import Array, Channels, Ride
from ..thin import thinned
from . import export_csv, export_parquet, export_racechrono, export_vbo

STEP_S = {"csv": 0.0, "parquet": 0.0, "racechrono": 0.01, "vbo": 0.01}  # both know up to 100 samples a second
_WRITE: dict[str, Callable[[Path, Iterator[Channels], float], None]] = {
    "csv": export_csv.write,
    "parquet": export_parquet.write,
    "racechrono": export_racechrono.write,
    "vbo": export_vbo.write,
}
_DATED = ("racechrono", "vbo")
_CLOCK_S = 1e8  # 1973: a log that begins later has the time in it


def export(ride: Ride, form: str, out: Path) -> int:
    """Write out, whole or not at all; how many rows. Raises InputError.

    racechrono and vbo want date and time. A board has no clock, so such a ride is taken to end when its log was
    written last: when it was recorded live, or pulled.
    """
    if form == "parquet":
        export_parquet.check()
    start_s, seconds, speeds = _first_pass(ride.log)
    if form in _DATED and start_s < _CLOCK_S:
        start_s = float(max(0, int(ride.log.stat().st_mtime - seconds)))
    count = 0

    def rows() -> Iterator[Channels]:
        nonlocal count
        blocks = (block for _, block in ride.blocks("exporting"))
        for block in thinned(blocks, STEP_S[form]) if STEP_S[form] else blocks:
            if form == "vbo" and len(speeds):
                block.speed_mps = np.interp(block.t_s, *speeds.T)  # a row without a speed would be one at 0
            count += len(block.t_s)
            yield block

    write_whole(out, lambda temporary: _WRITE[form](temporary, rows(), start_s))
    return count


def _first_pass(log: Path) -> tuple[float, float, Array]:
    """The log's own time of its first sample, its length in s, and its speeds: (n, 2), s from there and m/s."""
    start_s, seconds, speeds = None, 0.0, []
    for block in read_blocks(log):
        if start_s is None:
            start_s = float(block.time_text[0])
        seconds = float(block.time_us[-1]) * 1e-6
        there = ~np.isnan(block.speed_mps)
        speeds.append(np.column_stack((block.time_us[there] * 1e-6, block.speed_mps[there])))
    assert start_s is not None  # an empty log is refused
    return start_s, seconds, np.concatenate(speeds)
