"""Saves each result as soon as it is computed, so a run can be resumed after it was stopped or its disk was full.

The journal is a directory, on this computer or in a store such as S3, with one file per result. A file is written
completely or not at all, and has a check sum. Opening the journal drops damaged files, and the run recomputes their
results.
"""

import json
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any

from . import files
from .period import PeriodResult

_BATCH = 200  # number of results that are read together
_AGAIN = ".again"


class Journal:
    """The results of a run in a directory.

    A key identifies the logs and the options of a result. `key in journal` is true if the journal has its final result.
    KEY.json holds a final result. KEY.again.json holds a result that the next run should recompute.

    damaged: number of results that could not be read.
    """

    def __init__(self, directory: str) -> None:
        self._directory = directory
        self.damaged = 0
        names = [path.rpartition("/")[2].removesuffix(".json") for path in files.listed(directory)]
        self._final = {name for name in names if not name.endswith(_AGAIN)}
        self._provisional = {name.removesuffix(_AGAIN) for name in names if name.endswith(_AGAIN)}
        for _ in self.results(self._final | self._provisional):
            pass

    def __contains__(self, key: str) -> bool:
        return key in self._final

    def add(self, key: str, result: PeriodResult, again: bool = False) -> None:
        """Save a result. again: True if the next run should recompute the result.

        Raises InputError if the result cannot be written. Earlier results stay.
        """
        entry: dict[str, Any] = {"key": key, "result": asdict(result) | {"picture": []}}
        files.write_bytes(self._path(key, again), json.dumps(entry | {"crc32": _sum(entry)}).encode())
        (self._provisional if again else self._final).add(key)

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        """Yield the final result of each of these keys, or its provisional result. Keys without one are skipped."""
        saved = [key for key in keys if key in self._final or key in self._provisional]
        for first in range(0, len(saved), _BATCH):
            batch = saved[first : first + _BATCH]
            contents = files.read_all([self._path(key, key not in self._final) for key in batch])
            for key, content in zip(batch, contents, strict=True):
                if result := _parsed(content):
                    yield result
                else:
                    self.damaged += 1
                    (self._final if key in self._final else self._provisional).discard(key)

    def _path(self, key: str, again: bool) -> str:
        return f"{self._directory}/{key}{_AGAIN if again else ''}.json"


def _parsed(content: bytes) -> PeriodResult | None:
    try:
        entry = json.loads(content)
        return PeriodResult(**entry["result"]) if entry.pop("crc32") == _sum(entry) else None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _sum(entry: dict[str, Any]) -> int:
    return zlib.crc32(json.dumps(entry).encode())
