"""Assigns logs to vehicles, from MANIFEST.csv or from a pattern of paths."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE
from kickstand_tools.common.messages import InputError

from . import files

COLUMNS = ("vehicle", "path", "kind")
_KINDS = (MOTORCYCLE, CAR)
_MOST_BYTES = 100_000_000  # largest manifest in bytes, enough for a million logs


@dataclass(frozen=True)
class Period:
    """Logs of one vehicle with the same alignment of the sensor.

    vehicle: Name of the vehicle.
    mount: Name of this mounting of the sensor, "" if the vehicle has only one.
    kind: "motorcycle", or "car" for anything that does not lean.
    paths: Paths of the logs for fsspec, in chronological order.
    """

    vehicle: str
    mount: str
    kind: str
    paths: tuple[str, ...]


def read_manifest(path: str) -> list[Period]:
    """Read the periods of a manifest, a CSV file with the columns vehicle,path,kind and optionally mount.

    Rows with the same vehicle and mount form one period. Paths are relative to the manifest's directory and may be
    patterns such as logs/*.csv.gz. Raises InputError, which names the wrong line.

    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
    ...     _ = file.write("vehicle,path,kind\\nbus 12,/logs/1.csv,car\\nbus 12,/logs/2.csv,car\\n")
    ...     file.flush()
    ...     read_manifest(file.name)
    [Period(vehicle='bus 12', mount='', kind='car', paths=('/logs/1.csv', '/logs/2.csv'))]
    """
    base = path.rpartition("/")[0] if "/" in path else ""
    base = "/" if path.startswith("/") and not base else base
    kinds: dict[tuple[str, str], str] = {}
    logs: dict[tuple[str, str], dict[str, None]] = {}  # a dictionary keeps the order of the logs
    for line, cells in _rows(path):
        period = cells["vehicle"], cells.get("mount", "")
        if not cells["vehicle"] or not cells["path"]:
            raise InputError(f"{line}: vehicle and path must not be empty")
        if cells["kind"] not in _KINDS:
            raise InputError(f"{line}: kind is {cells['kind']!r}, it is motorcycle or car")
        if kinds.setdefault(period, cells["kind"]) != cells["kind"]:
            raise InputError(f"{line}: {cells['vehicle']} is a {kinds[period]} in an earlier line")
        pattern = files.join(base, cells["path"])
        matched = files.matches(pattern) if is_pattern(pattern) else []
        period_logs = logs.setdefault(period, {})
        for log in matched or [pattern]:  # the run reports a missing log
            if log in period_logs:
                raise InputError(f"{line}: {log} is given twice for {cells['vehicle']}")
            period_logs[log] = None
    if not logs:
        raise InputError(f"{path} has no vehicles: each line after the first is vehicle,path,kind")
    return [Period(*period, kinds[period], tuple(paths)) for period, paths in logs.items()]


def _rows(path: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield each row of a manifest, as the place for messages and the cells by the name of their column."""
    if not files.is_remote(path) and Path(path).is_dir():
        raise InputError(f"{path} is a directory: give {path}/MANIFEST.csv, or a pattern such as '{path}/*.csv'")
    try:
        text = files.read_bytes(path, _MOST_BYTES).decode("utf-8-sig")
        header, *rows = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO(text))] or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path} is no table: a manifest starts with the line {','.join(COLUMNS)}") from error
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}: a manifest starts with the line {','.join(COLUMNS)}")
    for number, row in enumerate(rows, 2):
        line = f"{path}, line {number}"
        if any(row) and len(row) != len(header):
            raise InputError(f"{line}: {len(row)} cells, the first line has {len(header)}")
        if any(row):
            yield line, dict(zip(header, row))


def by_pattern(pattern: str, kind: str = CAR) -> list[Period]:
    """Return one period for each file that the pattern matches. Each file is a separate vehicle, named by its path.

    Raises InputError if no file matches.

    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile(suffix=".csv") as file:
    ...     [period.vehicle == file.name for period in by_pattern(file.name[:-6] + "*.csv")]
    [True]
    """
    paths = files.matches(pattern)
    if not paths:
        raise InputError(f"{pattern} matches no file")
    return [Period(files.printable(path), "", kind, (path,)) for path in paths]


def is_pattern(path: str) -> bool:
    return any(mark in path for mark in "*?[")
