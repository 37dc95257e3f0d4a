"""Assigns logs to vehicles, by MANIFEST.csv or by a pattern of paths."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE
from kickstand_tools.common.errors import InputError

from . import files

COLUMNS = ("vehicle", "path", "kind")
_KINDS = (MOTORCYCLE, CAR)
_MOST_BYTES = 100_000_000  # largest manifest: a million logs


@dataclass(frozen=True)
class Period:
    """Logs of one vehicle, in chronological order, in which the sensor should have had the same alignment.

    kind: "motorcycle" or "car" (anything that does not lean). mount: name of the mounting, "" if the vehicle has only
    one. paths: the logs' paths, as fsspec takes them.
    """

    vehicle: str
    mount: str
    kind: str
    paths: tuple[str, ...]


def read_manifest(path: str) -> list[Period]:
    """The periods of a manifest: CSV with the columns vehicle,path,kind and optionally mount.

    Rows of the same vehicle and mount form one period. Paths are relative to the manifest's directory and may be
    patterns (logs/*.csv.gz). Raises InputError naming the line.

    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
    ...     _ = file.write("vehicle,path,kind\\nbus 12,/logs/1.csv,car\\nbus 12,/logs/2.csv,car\\n")
    ...     file.flush()
    ...     read_manifest(file.name)
    [Period(vehicle='bus 12', mount='', kind='car', paths=('/logs/1.csv', '/logs/2.csv'))]
    """
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
    base = path.rpartition("/")[0] if "/" in path else ""
    base = "/" if path.startswith("/") and not base else base
    kinds: dict[tuple[str, str], str] = {}
    logs: dict[tuple[str, str], dict[str, None]] = {}  # in order
    for line, row in enumerate(rows, 2):
        if not any(row):
            continue
        if len(row) != len(header):
            raise InputError(f"{path}, line {line}: {len(row)} cells, the first line has {len(header)}")
        cells = dict(zip(header, row))
        period = cells["vehicle"], cells.get("mount", "")
        if not cells["vehicle"] or not cells["path"]:
            raise InputError(f"{path}, line {line}: vehicle and path must not be empty")
        if cells["kind"] not in _KINDS:
            raise InputError(f"{path}, line {line}: kind is {cells['kind']!r}, it is motorcycle or car")
        if kinds.setdefault(period, cells["kind"]) != cells["kind"]:
            raise InputError(f"{path}, line {line}: {cells['vehicle']} is a {kinds[period]} in an earlier line")
        found = _found(files.join(base, cells["path"]))
        known = logs.setdefault(period, {})
        for log in found:
            if log in known:
                raise InputError(f"{path}, line {line}: {log} is given twice for {cells['vehicle']}")
            known[log] = None
    if not logs:
        raise InputError(f"{path} has no vehicles: each line after the first is vehicle,path,kind")
    return [Period(*period, kinds[period], tuple(paths)) for period, paths in logs.items()]


def by_pattern(pattern: str, kind: str = CAR) -> list[Period]:
    """One period per file that the pattern matches: a separate vehicle, named by its path. Raises InputError.

    >>> import tempfile
    >>> with tempfile.NamedTemporaryFile(suffix=".csv") as file:
    ...     [period.vehicle == file.name for period in by_pattern(file.name[:-6] + "*.csv")]
    [True]
    """
    found = files.matches(pattern)
    if not found:
        raise InputError(f"{pattern} matches no file")
    return [Period(files.printable(path), "", kind, (path,)) for path in found]


def is_pattern(path: str) -> bool:
    """True if the path contains * ? or [."""
    return any(mark in path for mark in "*?[")


def _found(path: str) -> list[str]:
    """The files that match a pattern; the path itself if none does: the run then reports it as missing."""
    return (files.matches(path) or [path]) if is_pattern(path) else [path]
