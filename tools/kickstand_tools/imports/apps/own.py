"""Reads Kickstand's own files: logs, also if saved by a spreadsheet, and the CSV or Parquet files of `kickstand
export`.

racechrono.py reads exports in RaceChrono's format. An exported VBO cannot be imported, because it has neither the
vertical force nor the pitch rate.
"""

import io

import numpy as np

from ...common.installation import extra
from ...common.messages import InputError
from ...logs.csv_text import COLUMNS, MOST_CELLS
from ..files import RecordingFile
from ..recording import AppRecording, Sheet, first_names, read_sheet, sensor_of, track_of
from ..units import EPOCH_NS, Nanoseconds

NAME = "Kickstand"
_FORCES = ("left_g", "up_g", "forward_g")
_RATES = ("pitch_rate_dps", "yaw_rate_dps", "roll_rate_dps")
_RATE_SIGNS = np.array([-1.0, 1.0, 1.0])  # pitch is positive nose up, which is negative about the left axis


def find_recordings(files: list[RecordingFile]) -> list[list[RecordingFile]]:
    """Each of Kickstand's logs and exports is a recording."""
    return [[file] for file in files if _is_ours(file)]


def read(files: list[RecordingFile], name: str) -> AppRecording:
    """Read a recording. Raises InputError for the output of a replay, which lacks readings."""
    sheet = _sheet(files[0])
    time_ns = sheet.times(sheet.columns.index("t_s"))
    log, no_log = sheet.axes(*COLUMNS[1:])
    exported, no_export = sheet.axes(*_FORCES, *_RATES)
    if not no_log:
        accel = sensor_of(sheet, time_ns, log[:3], "accelerometer", "g", "+1 g up")
        gyro = sensor_of(sheet, time_ns, log[3:], "gyro", "deg/s", "right-handed")
    elif not no_export:
        accel = sensor_of(sheet, time_ns, exported[:3], "accelerometer", "g", "left, up, forward")
        gyro = sensor_of(sheet, time_ns, exported[3:], "gyro", "deg/s", "left, up, forward", _RATE_SIGNS)
    else:
        raise InputError(f"{name} contains a lean but no readings: give the log that it was made from")
    speed, lat, lon = (sheet.place(column) for column in ("speed_mps", "lat_deg", "lon_deg"))
    track = track_of(sheet, time_ns, speed, lat, lon)
    temp_c = sheet.numbers(sheet.place("temp_c"))
    from_1970 = bool(len(time_ns)) and float(np.median(time_ns)) > EPOCH_NS
    utc_ns = 0 if from_1970 else _utc_ns(sheet, time_ns)
    return AppRecording(NAME, accel, gyro, track, temp_c, utc_ns=utc_ns, vehicle_axes=bool(no_log))


def _utc_ns(sheet: Sheet, time_ns: Nanoseconds) -> int | None:
    """UTC minus the log's own time, ns since 1970; None if the log has no UTC."""
    utc_s = sheet.numbers(sheet.place("utc_s"))
    valid = np.isfinite(utc_s)
    return int(np.median(utc_s[valid] * 1e9 - time_ns[valid])) if np.any(valid) else None


def _is_ours(file: RecordingFile) -> bool:
    if file.content.startswith(b"PAR1"):
        return True
    head = first_names(file)
    return "t_s" in head and (set(COLUMNS) <= set(head) or set(_FORCES) <= set(head))


def _sheet(file: RecordingFile) -> Sheet:
    if not file.content.startswith(b"PAR1"):
        return read_sheet(file)
    try:
        from pyarrow import parquet

        size = parquet.ParquetFile(io.BytesIO(file.content)).metadata
        if size.num_rows * size.num_columns > MOST_CELLS:
            raise InputError(f"{file.name} is too large: over {MOST_CELLS / 1e6:.0f} million cells")
        table = parquet.read_table(io.BytesIO(file.content))
    except ImportError as error:
        raise InputError("Parquet needs pyarrow: " + extra("rides")) from error
    except (ValueError, OSError, NotImplementedError, KeyError, TypeError) as error:
        raise InputError(f"{file.name} is damaged or cut short: copy it again") from error
    columns = [str(column) for column in table.column_names]
    if "t_s" not in columns:
        raise InputError(f"{file.name}: not a ride that kickstand has exported: its columns are {', '.join(columns)}")
    return Sheet(file.name, columns, [column.to_numpy() for column in table.columns])
