"""Each result as it comes, one line of JSON each: what a run that was stopped, or whose disk filled up, had finished.

A line that was cut, by a loss of power or a full disk, is dropped when the file is opened again.
"""

import contextlib
import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

from ..errors import InputError, cause
from .period import PeriodResult


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
            self._file.seek(0)
            self._end = 0
            for line in self._file:
                if not line.endswith(b"\n"):
                    break
                self._note(line)
                self._end += len(line)
            self._file.truncate(self._end)
        except (OSError, ValueError) as error:
            raise InputError(f"{self._path} cannot be used: {cause(error)}: give --out another directory") from error
        return self

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
        line = json.dumps({"key": key, "again": again, "result": asdict(result) | {"picture": []}}).encode() + b"\n"
        try:
            self._file.write(line)
            self._file.flush()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(self._end)
            raise InputError(
                f"{self._path} cannot be written: {cause(error)}; what is finished is kept, the same command goes on"
            ) from error
        self._note(line)
        self._end += len(line)

    def sync(self) -> None:
        """What was added outlasts a loss of power from now on."""
        os.fsync(self._file.fileno())

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        """Those of the keys that are there, the latest of each."""
        with open(self._path, "rb") as file:
            for key in keys:
                if key in self._places:
                    file.seek(self._places[key])
                    yield PeriodResult(**json.loads(file.readline())["result"])

    def _note(self, line: bytes) -> None:
        entry = json.loads(line)
        self._places[entry["key"]] = self._end
        if entry["again"]:
            self._again.add(entry["key"])
        else:
            self._again.discard(entry["key"])
