"""Each result as it comes: what a run that was stopped, or whose disk filled up, had finished.

In a directory of this computer a line of JSON each, in one file; a line that was cut, by a loss of power or a full
disk, is dropped when the file is opened again. In a store such as S3, whose files cannot grow, a file each.
"""

import contextlib
import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..errors import InputError, cause
from . import files
from .period import PeriodResult

_AT_ONCE = 200  # results that are fetched from a store together


class Journal:
    """with Journal(path) as journal: journal.add(key, result); key in journal; journal.results(keys).

    key: tells the result of these logs, with these options, from any other. Results are read from the file again when
    they are wanted: memory holds where each of them is.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._places: dict[str, int] = {}
        self._again: set[str] = set()  # of results that another run may better

    def __enter__(self) -> "Journal":
        try:
            self._file = open(self._path, "a+b")
            self._lock()
            self._file.seek(0)
            self._end = 0
            for line in self._file:
                if not line.endswith(b"\n"):
                    break
                self._note(line)
                self._end += len(line)
            self._file.truncate(self._end)
        except (ValueError, LookupError, TypeError) as error:
            self._file.close()
            what = "is damaged: remove it, and all is worked out again, or give --out another directory"
            raise InputError(f"{self._path} {what}") from error
        except OSError as error:
            raise InputError(f"{self._path} cannot be used: {cause(error)}: give --out another directory") from error
        return self

    def _lock(self) -> None:
        """Two runs that write into one file would take each other's results for their own."""
        with contextlib.suppress(ImportError):  # Windows
            import fcntl

            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                self._file.close()
                raise InputError(f"another run works in {self._path.parent}: wait for it, or end it") from error

    def __exit__(self, *exception: object) -> None:
        with contextlib.suppress(OSError):
            self._file.close()
            if not self._end:
                self._path.unlink()

    def __contains__(self, key: str) -> bool:
        """True if the result is there for good."""
        return key in self._places and key not in self._again

    def add(self, key: str, result: PeriodResult, again: bool = False) -> None:
        """Keep a result. again: another run is to try for a better one. Raises InputError, and what was kept stays."""
        line = _line(key, result, again) + b"\n"
        try:
            self._file.write(line)
            self._file.flush()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(self._end)
            raise self._cannot(error) from error
        self._note(line)
        self._end += len(line)

    def sync(self) -> None:
        """What was added outlasts a loss of power from now on. Raises InputError."""
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            raise self._cannot(error) from error

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        """Those of the keys that are there, the latest of each."""
        with open(self._path, "rb") as file:
            for key in keys:
                if key in self._places:
                    file.seek(self._places[key])
                    yield _result(file.readline())

    def _cannot(self, error: OSError) -> InputError:
        return InputError(
            f"{self._path} cannot be written: {cause(error)}; what is finished is kept, the same command goes on"
        )

    def _note(self, line: bytes) -> None:
        entry = json.loads(line)
        self._places[entry["key"]] = self._end
        if entry["again"]:
            self._again.add(entry["key"])
        else:
            self._again.discard(entry["key"])


class StoreJournal:
    """The same, with a directory in a store: KEY.json is there for good, KEY.again.json may be bettered."""

    def __init__(self, directory: str) -> None:
        self._directory = directory
        self._kept: set[str] = set()
        self._again: set[str] = set()

    def __enter__(self) -> "StoreJournal":
        for path in files.listed(self._directory):
            name = path.rpartition("/")[2]
            (self._again if name.endswith(".again.json") else self._kept).add(name.partition(".")[0])
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def __contains__(self, key: str) -> bool:
        return key in self._kept

    def add(self, key: str, result: PeriodResult, again: bool = False) -> None:
        files.write_bytes(self._path(key, again), _line(key, result, again))
        (self._again if again else self._kept).add(key)

    def sync(self) -> None:
        pass

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        there = [self._path(key, key not in self._kept) for key in keys if key in self._kept or key in self._again]
        for first in range(0, len(there), _AT_ONCE):
            yield from map(_result, files.read_all(there[first : first + _AT_ONCE]))

    def _path(self, key: str, again: bool) -> str:
        return f"{self._directory}/{key}{'.again' if again else ''}.json"


def _line(key: str, result: PeriodResult, again: bool) -> bytes:
    return json.dumps({"key": key, "again": again, "result": asdict(result) | {"picture": []}}).encode()


def _result(line: bytes) -> PeriodResult:
    entry: dict[str, Any] = json.loads(line)
    return PeriodResult(**entry["result"])
