"""Saves each result as soon as it is computed, so a run can be resumed after it was stopped or its disk was full.

The journal is a directory, on this computer or in a store such as S3, with one file KEY.json per result. A file is
written completely or not at all, and has a check sum. Opening the journal drops damaged files, and the run recomputes
their results.
"""

import json
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any

from . import files
from .period import PeriodResult

_BATCH = 200  # number of results that are read together


class Journal:
    """The results of a run in a directory. `key in journal` is true if the journal has the final result for a key.

    A key identifies the logs and the options of a result.
    """

    def __init__(self, directory: str) -> None:
        self._directory = directory
        self.damaged = 0  # number of results that could not be read
        keys = [path.rpartition("/")[2].removesuffix(".json") for path in files.listed(directory)]
        self._again = dict.fromkeys(keys, False)  # True for a result that the next run recomputes
        for key, entry in self._entries(keys):
            self._again[key] = entry.get("again", False)

    def __contains__(self, key: str) -> bool:
        return not self._again.get(key, True)

    def add(self, key: str, result: PeriodResult, again: bool = False) -> None:
        """Save a result. again: True if the next run should recompute the result.

        Raises InputError if the result cannot be written. Earlier results stay.
        """
        entry: dict[str, Any] = {"key": key, "again": again, "result": asdict(result) | {"picture": []}}
        files.write_bytes(self._path(key), json.dumps(entry | {"crc32": _sum(entry)}).encode())
        self._again[key] = again

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        """Yield the result of each of these keys. Keys without a result are skipped."""
        for _, entry in self._entries([key for key in keys if key in self._again]):
            yield PeriodResult(**entry["result"])

    def _entries(self, keys: list[str]) -> Iterator[tuple[str, dict[str, Any]]]:
        for first in range(0, len(keys), _BATCH):
            batch = keys[first : first + _BATCH]
            contents = files.read_all([self._path(key) for key in batch])
            for key, content in zip(batch, contents, strict=True):
                if entry := _parsed(content):
                    yield key, entry
                else:
                    self.damaged += 1
                    del self._again[key]

    def _path(self, key: str) -> str:
        return f"{self._directory}/{key}.json"


def _parsed(content: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(content)
        return entry if entry.pop("crc32") == _sum(entry) else None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _sum(entry: dict[str, Any]) -> int:
    return zlib.crc32(json.dumps(entry).encode())
