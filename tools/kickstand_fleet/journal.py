"""Saves each result as soon as it is computed, so a run can be resumed after it was stopped or its disk was full.

In a directory on this computer, the journal is one file with a line of JSON per result. In a store such as S3 files
cannot grow, so there is one file per result. Each result has a check sum. A power loss or a full disk can leave cut or
damaged lines. Opening the journal drops these lines, and the run recomputes their results.
"""

import contextlib
import json
import os
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kickstand_tools.common.errors import InputError, cause

from . import KEPT, files
from .period import PeriodResult

_AT_ONCE = 200  # number of results that are fetched from a store together
_LONGEST = 1 << 26  # longest line in bytes, 100 times the line of a mount with a thousand logs


class Journal:
    """The results of a run in a file, used as a context: `with Journal(path) as journal`.

    A key identifies the logs and the options of a result. `key in journal` is true if the journal has its final result.
    Memory holds only the position of each result in the file. results() reads the results from the file again.

    damaged: number of lines that could not be used.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._offsets: dict[str, int] = {}
        self._provisional: set[str] = set()  # keys of results that the next run should recompute
        self.damaged = 0

    def __enter__(self) -> "Journal":
        try:
            self._open()
            self._end = 0
            while line := self._file.readline(_LONGEST):
                if not self._note(line) and line.strip():
                    self.damaged += 1
                    self._file.seek(self._end)
                    # Overwrite the damaged line with blanks. If the line stayed, the next run would count it again
                    self._file.write(b" " * (len(line) - 1) + b"\n")
                self._end += len(line)
            self._file.flush()
        except OSError as error:
            raise InputError(f"{self._path} cannot be used: {cause(error)}: give --out another directory") from error
        return self

    def _open(self) -> None:
        """Open the file and lock it. Reopen the file if another run removed it before it was locked."""
        while True:
            self._file = open(os.open(self._path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666), "r+b")
            self._lock()
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self._file.fileno()), self._path.stat()):
                    return
            self._file.close()

    def _lock(self) -> None:
        """Lock the file. Raises InputError if another run has locked the file."""
        with contextlib.suppress(ImportError):  # Windows
            import fcntl

            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                self._file.close()
                raise InputError(f"another run works in {self._path.parent}: wait for it, or end it") from error

    def __exit__(self, *exception: object) -> None:
        with contextlib.suppress(OSError):
            if not self._end and os.name != "nt":  # remove an empty file while it is still locked
                self._path.unlink()
        with contextlib.suppress(OSError):
            self._file.close()
            if not self._end and os.name == "nt":  # Windows cannot remove an open file
                self._path.unlink()

    def __contains__(self, key: str) -> bool:
        """True if there is a final result for this key."""
        return key in self._offsets and key not in self._provisional

    def add(self, key: str, result: PeriodResult, again: bool = False) -> None:
        """Save a result. again: True if the next run should recompute the result.

        Raises InputError if the result cannot be written. Earlier results stay in the file.
        """
        line = _line(key, result, again) + b"\n"
        try:
            self._write(line)
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.raw.truncate(self._end)
            raise self._write_error(error) from error
        self._note(line)
        self._end += len(line)

    def _write(self, line: bytes) -> None:
        """Append a line without a buffer, because a buffer would later write the rest of a line that did not fit."""
        self._file.raw.seek(self._end)
        remaining = memoryview(line)
        while remaining:
            remaining = remaining[self._file.raw.write(remaining) :]

    def sync(self) -> None:
        """Flush the results to the disk, so that they survive a power loss. Raises InputError."""
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            raise self._write_error(error) from error

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        """Yield the latest result of each of these keys. Keys without a result are skipped."""
        with open(self._path, "rb") as file:
            for key in keys:
                if key in self._offsets:
                    file.seek(self._offsets[key])
                    if entry := _entry(file.readline()):
                        yield entry[2]

    def _write_error(self, error: OSError) -> InputError:
        return InputError(f"{self._path} cannot be written: {cause(error)}; {KEPT}")

    def _note(self, line: bytes) -> bool:
        """Record the position of a line's result. Returns False for a damaged line."""
        if not (line.endswith(b"\n") and (entry := _entry(line))):
            return False
        key, again, _ = entry
        self._offsets[key] = self._end
        (self._provisional.add if again else self._provisional.discard)(key)
        return True


class StoreJournal:
    """A journal with the methods of Journal, in a directory of a store.

    KEY.json holds a final result. KEY.again.json holds a result that the next run should recompute. All files are read
    when the journal is opened. Damaged results are recomputed.
    """

    def __init__(self, directory: str) -> None:
        self._directory = directory
        self._final: set[str] = set()
        self._provisional: set[str] = set()
        self.damaged = 0

    def __enter__(self) -> "StoreJournal":
        for path in files.listed(self._directory):
            name = path.rpartition("/")[2]
            (self._provisional if name.endswith(".again.json") else self._final).add(name.partition(".")[0])
        for _ in self.results(self._final | self._provisional):
            pass
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def __contains__(self, key: str) -> bool:
        return key in self._final

    def add(self, key: str, result: PeriodResult, again: bool = False) -> None:
        files.write_bytes(self._path(key, again), _line(key, result, again))
        (self._provisional if again else self._final).add(key)

    def sync(self) -> None:
        pass

    def results(self, keys: Iterable[str]) -> Iterator[PeriodResult]:
        saved = [
            self._path(key, key not in self._final) for key in keys if key in self._final or key in self._provisional
        ]
        for first in range(0, len(saved), _AT_ONCE):
            paths = saved[first : first + _AT_ONCE]
            for path, content in zip(paths, files.read_all(paths)):
                if entry := _entry(content):
                    yield entry[2]
                else:
                    self.damaged += 1
                    (self._provisional if path.endswith(".again.json") else self._final).discard(
                        path.rpartition("/")[2].partition(".")[0]
                    )

    def _path(self, key: str, again: bool) -> str:
        return f"{self._directory}/{key}{'.again' if again else ''}.json"


def _line(key: str, result: PeriodResult, again: bool) -> bytes:
    entry: dict[str, Any] = {"key": key, "again": again, "result": asdict(result) | {"picture": []}}
    return json.dumps(entry | {"crc32": _sum(entry)}).encode()


def _entry(line: bytes) -> tuple[str, bool, PeriodResult] | None:
    """Parse a line of the journal. Returns (key, again, result), or None for a damaged line."""
    try:
        entry = json.loads(line)
        sum_then = entry.pop("crc32")
        return (entry["key"], entry["again"], PeriodResult(**entry["result"])) if sum_then == _sum(entry) else None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return None


def _sum(entry: dict[str, Any]) -> int:
    return zlib.crc32(json.dumps(entry).encode())
