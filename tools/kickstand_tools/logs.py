"""Recorded logs: CSV with the columns of design's contract, plain or gzipped."""

import csv
import gzip
import io
import math
import statistics
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from .errors import InputError, cause
from .output import write_whole

COLUMNS = ("t_s", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps")
OPTIONAL = ("speed_mps", "temp_c")  # may be empty in a row
ROOM_TEMP_C = 25.0

# Beyond these it is another unit (m/s2, counts): the sensor's widest ranges are 16 g and 2000 deg/s.
_LIMITS = {"t_s": 1e10, "ax_g": 20.0, "ay_g": 20.0, "az_g": 20.0, "temp_c": 200.0, "speed_mps": 200.0}
_LIMITS |= {"gx_dps": 2500.0, "gy_dps": 2500.0, "gz_dps": 2500.0}
_UNITS = {"t_s": "seconds", "temp_c": "degrees Celsius", "speed_mps": "m/s"}
_UNITS |= {"ax_g": "g", "ay_g": "g", "az_g": "g", "gx_dps": "deg/s", "gy_dps": "deg/s", "gz_dps": "deg/s"}


@dataclass
class Log:
    """One recording in the sensor's axes.

    time_us: n integers, strictly increasing, 0 for the first.  time_text: n, as they stand in the file.
    readings: n of (ax, ay, az in g, temperature in C, gx, gy, gz in deg/s), the chip's order.
    speed_mps: n, None where there is no new value.
    """

    path: Path
    time_text: list[str]
    time_us: list[int]
    readings: list[tuple[float, ...]]
    speed_mps: list[float | None]


def read_log(path: Path, minimum: int = 2) -> Log:
    """Read a log of at least minimum samples. Raises InputError naming the file and the line."""
    rows = csv.reader(io.StringIO(_text(path), newline=""))
    try:
        return _parse(path, rows, minimum)
    except csv.Error as error:
        raise InputError(f"{path}, line {rows.line_num}: not CSV ({error}): is it a log?") from error


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file, gzipped if its name ends in .gz, whole or not at all."""

    def write(temporary: Path) -> None:
        opened = gzip.open if path.suffix == ".gz" else open
        with opened(temporary, "wt", encoding="ascii", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(rows)

    write_whole(path, write)


def _text(path: Path) -> str:
    """The whole file as text, unpacked."""
    if path.is_dir():
        raise InputError(f"{path} is a directory: give the name of a log in it")
    try:
        content = path.read_bytes()
        if path.suffix == ".gz" and content:
            content = gzip.decompress(content)
    except gzip.BadGzipFile as error:
        raise InputError(f"{path} is not a gzip file: unpacked logs have names without .gz") from error
    except (EOFError, zlib.error) as error:
        raise InputError(f"{path} is damaged or cut short: copy it again") from error
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error
    if not content.strip():
        raise InputError(f"{path} is empty: a log starts with the line {','.join(COLUMNS)}")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}, line {line}: not text: give a log as CSV or as .csv.gz") from error


def _parse(path: Path, rows, minimum: int) -> Log:
    header = [name.strip() for name in next(rows, [])]
    missing = [name for name in COLUMNS if name not in header]
    if missing and any(mark in "".join(header) for mark in ";\t"):
        raise InputError(f"{path}, line 1: values stand apart by ; or tab: save it with commas between them")
    if missing:
        raise InputError(
            f"{path}, line 1: no column {', '.join(missing)}: a log starts with {','.join(COLUMNS)}"
        )
    for name in COLUMNS + OPTIONAL:
        if header.count(name) > 1:
            raise InputError(f"{path}, line 1: column {name} is there twice: leave one")
    places = {name: header.index(name) for name in COLUMNS + OPTIONAL if name in header}
    log = Log(path, [], [], [], [])
    before = first_us = 0
    for cells in rows:
        if not cells:
            continue  # a blank line, often the last
        where = f"{path}, line {rows.line_num}"
        if len(cells) != len(header):
            raise InputError(
                f"{where}: {len(cells)} values under {len(header)} column names: is the line cut?"
            )
        value = {name: _number(cells[place], name, where) for name, place in places.items()}
        now = round(_present(value["t_s"]) * 1e6)
        if not log.time_us:
            first_us = now
        elif now <= before:
            what = "repeats" if now == before else "goes back from %.6f" % (before / 1e6)
            raise InputError(f"{where}: time {what} at {cells[places['t_s']].strip()} s: it has to increase")
        before = now
        ax, ay, az, gx, gy, gz = (_present(value[name]) for name in COLUMNS[1:])
        temperature = value.get("temp_c")
        log.time_text.append(cells[places["t_s"]].strip())
        log.time_us.append(now - first_us)
        log.readings.append((ax, ay, az, ROOM_TEMP_C if temperature is None else temperature, gx, gy, gz))
        log.speed_mps.append(value.get("speed_mps"))
    if len(log.time_us) < minimum:
        raise InputError(f"{path} is too short: {len(log.time_us)} samples, at least {minimum} are needed")
    _check_units(log)
    return log


def _check_units(log: Log) -> None:
    """Raise InputError for a log in units that are easily taken for the right ones."""
    sizes = [math.hypot(*reading[:3]) for reading in log.readings]
    if 5.0 < statistics.median(sizes) < 20.0:
        raise InputError(f"{log.path}: accelerations look like m/s2: divide them by 9.80665, their unit is g")
    if len(log.time_us) > 1 and log.time_us[-1] / (len(log.time_us) - 1) >= 4e6:
        raise InputError(f"{log.path}: seconds between samples: is t_s in milliseconds?")


def _number(cell: str, name: str, where: str) -> float | None:
    """The value of a cell; None for an empty one where that is allowed."""
    if name in OPTIONAL and not cell.strip():
        return None
    try:
        value = float(cell.replace("_", "?"))  # Python would read 1_0 as 10
    except ValueError:
        raise InputError(f"{where}: {name} is {_shown(cell)}, not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: {name} is {_shown(cell)}: a number is needed")
    if abs(value) > _LIMITS[name]:
        raise InputError(f"{where}: {name} is {_shown(cell)}, past any reading: its unit is {_UNITS[name]}")
    return value


def _present(value: float | None) -> float:
    assert value is not None  # only optional columns may be empty
    return value


def _shown(cell: str) -> str:
    text = cell.strip()
    return ascii(text if len(text) <= 20 else text[:20] + "...") if text else "empty"
