"""Writes accelerations along the vehicle's axes as Parquet.

The files are in one directory per vehicle and day. Libraries for data frames read all files as one table.
"""

import datetime
import io

import numpy as np
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log, float_schema
from kickstand_tools.logs.source import log_stem

from .files import file_stem, folder_value, printable, write_bytes
from .manifest import Period

UNKNOWN_DAY = "unknown"
_FINE = ("t_s", "utc_s")  # columns that need 64-bit floats
# Each column with its unit
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


def write(directory: str, period: Period, log: Log, calibration: CalibrationFile) -> list[str]:
    """Write a log to DIRECTORY/vehicle=.../day=.../NAME.parquet, one file per day of Universal Time or "unknown".

    NAME consists of the mount, the log's name and a hash of the log's path. The hash keeps the files of two logs apart,
    and a second run overwrites the same files.

    calibration: must be aligned. Returns the paths of the files. Raises InputError if a file cannot be written.
    """
    import pyarrow
    from pyarrow import parquet

    force, rate = calibration.in_vehicle(log.readings)
    utc_s = log.t_s + (np.nan if log.start_utc_s is None else log.start_utc_s)
    values = dict(zip(COLUMNS, (log.t_s, utc_s, *force.T, *rate.T, log.speed_mps), strict=True))
    metadata = {"made_by": "kickstand fleet", "vehicle": period.vehicle, "mount": period.mount}
    schema = float_schema(
        COLUMNS, _FINE, metadata | {"log": printable(log.name), "axes": "left, up, forward of the vehicle"}
    )
    readable = f"{period.mount} {log_stem(log.name)}".strip()
    name = file_stem(readable, period.vehicle, period.mount, log.name) + ".parquet"
    days = np.floor(utc_s / 86_400.0) if log.start_utc_s is not None else np.zeros(len(log.t_s))
    paths = []
    for day in np.unique(days):
        date = _date(day) if log.start_utc_s is not None else UNKNOWN_DAY
        rows = days == day
        arrays = [pyarrow.array(values[f.name][rows], type=f.type, from_pandas=True) for f in schema]
        file = io.BytesIO()
        parquet.write_table(pyarrow.table(arrays, schema=schema), file, compression="zstd")
        path = f"{directory}/vehicle={folder_value(period.vehicle)}/day={date}/{name}"
        write_bytes(path, file.getvalue())
        paths.append(path)
    return paths


def _date(day: float) -> str:
    return (datetime.date(1970, 1, 1) + datetime.timedelta(days=int(day))).isoformat()
