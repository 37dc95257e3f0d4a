"""Accelerations along the vehicle's axes as Parquet, in directories by vehicle and day as data frames read them."""

import datetime
import io
import re

import numpy as np

from ..calibration.file import CalibrationFile
from ..logs.log import Log
from ..logs.source import log_stem
from .files import write_bytes

UNKNOWN_DAY = "unknown"
_FINE = ("t_s", "utc_s")  # 32-bit floats are too coarse for these
# column: unit
COLUMNS = {
    "t_s": "s since the log's first sample",
    "utc_s": "s since 1970",
    "left_g": "g",
    "up_g": "g",
    "forward_g": "g",
    "about_left_dps": "deg/s",
    "about_up_dps": "deg/s",
    "about_forward_dps": "deg/s",
    "speed_mps": "m/s",
}


def write(directory: str, vehicle: str, log: Log, calibration: CalibrationFile) -> list[str]:
    """Write a log to DIRECTORY/vehicle=.../day=.../NAME.parquet, one file for each day of Universal Time in it (day
    "unknown" where the log has none). Returns the paths. calibration: an aligned one. Raises InputError."""
    import pyarrow
    from pyarrow import parquet

    force, rate = calibration.in_vehicle(log.readings)
    told = np.isfinite(log.utc_s)
    start_s = float(np.median((log.utc_s - log.t_s)[told])) if np.any(told) else float("nan")
    values = dict(
        zip(COLUMNS, (log.t_s, log.t_s + start_s, *force.T, *rate.T, log.speed_mps), strict=True),
    )
    schema = pyarrow.schema(
        [
            pyarrow.field(name, pyarrow.float64() if name in _FINE else pyarrow.float32(), metadata={"unit": unit})
            for name, unit in COLUMNS.items()
        ],
        metadata={"made_by": "kickstand fleet", "log": log.name, "axes": "left, up, forward of the vehicle"},
    )
    days = np.floor(values["utc_s"] / 86_400.0) if np.any(told) else np.zeros(len(log.t_s))
    paths = []
    for day in np.unique(days):
        name = _date(day) if np.any(told) else UNKNOWN_DAY
        rows = days == day
        arrays = [pyarrow.array(values[f.name][rows], type=f.type, from_pandas=True) for f in schema]
        file = io.BytesIO()
        parquet.write_table(pyarrow.table(arrays, schema=schema), file, compression="zstd")
        path = f"{directory}/vehicle={safe_name(vehicle)}/day={name}/{safe_name(log_stem(log.name))}.parquet"
        write_bytes(path, file.getvalue())
        paths.append(path)
    return paths


def safe_name(name: str) -> str:
    """A name that a file or a directory can have: what else is in it becomes its code."""
    return re.sub(r"[^A-Za-z0-9._-]", lambda found: f"%{ord(found[0]):02X}", name).lstrip(".") or "%00"


def _date(day: float) -> str:
    return (datetime.date(1970, 1, 1) + datetime.timedelta(days=int(day))).isoformat()
