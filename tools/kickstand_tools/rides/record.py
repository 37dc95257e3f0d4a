"""Streams a ride from the board over USB to a log, while the display keeps working."""

import contextlib
import gzip
import io
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.live import Live

from ..calibration.file import write_calibration
from ..common.messages import InputError
from ..common.output import check_output, whole_file
from ..deploy.connection import connected, restart
from . import ride_log
from .block_reader import StoredBlock
from .stream import LiveReading, StreamLog, blocks


@dataclass(frozen=True)
class RecordResult:
    """The written files, the duration in s, the number of readings, and one line per gap or fault."""

    log: Path
    calibration: Path
    seconds: float
    readings: int
    notes: list[str]


def record(
    port: str | None,
    out: Path,
    begin: Callable[[str], None] | None = None,
    live: Callable[[LiveReading], None] | None = None,
) -> RecordResult:
    """Write readings to a log, and NAME.cal.json beside it, until Ctrl-C. Then restart the board.

    Existing files are not overwritten, because a ride cannot be repeated.

    port: the board's port; None for the only board that is plugged in.
    out: path of the log, which ends in .csv or .csv.gz.
    begin: called with the port's name before the first readings. live: called with a LiveReading every half second.
    Raises InputError if a file cannot be written, or if the board sends no readings.
    """
    if not out.name.endswith((".csv", ".csv.gz")):
        raise InputError(f"{out}: give --out a name that ends in .csv or .csv.gz")
    check_output(out, [])
    calibration_file = ride_log.calibration_path(out)
    for path in (out, calibration_file):
        if path.exists():
            raise InputError(f"{path} exists already: give --out another name")
    with connected(port) as (transport, name):
        try:
            if begin:
                begin(name)
            stopped = threading.Event()
            recorded = StreamLog(stopped, live)
            notes: list[str] = []
            # Write the calibration before the log, because the log may fill the disk
            with whole_file(out) as temporary, whole_file(calibration_file) as calibration, _signals(stopped):
                with _GrowingFile(temporary, out.suffix == ".gz") as file:
                    first = _save_first_calibration(blocks(transport, name, notes, stopped), calibration)
                    recorded.write(file, first, notes)
        finally:
            with contextlib.suppress(Exception):  # the cable may be unplugged
                restart(transport)
    return RecordResult(out, calibration_file, recorded.seconds, recorded.count, notes)


def _save_first_calibration(blocks: Iterator[StoredBlock], calibration: Path) -> Iterator[StoredBlock]:
    """Yield the blocks. Before the first, write its calibration to the file `calibration`."""
    for i, block in enumerate(blocks):
        if i == 0:
            write_calibration(calibration, ride_log.calibration(block))
        yield block


class _GrowingFile(io.TextIOBase):
    """A text file that contains only complete writes. If a write fails on a full disk, the earlier content stays.

    packed: True to compress with gzip. Each write is a separate member, because a gzip file that is cut inside a member
        is damaged.
    """

    def __init__(self, path: Path, packed: bool) -> None:
        self._file, self._packed, self._length = open(path, "wb", buffering=0), packed, 0

    def write(self, text: str) -> int:
        """Write all of the text, or nothing. Raises OSError if the write fails."""
        data = memoryview(gzip.compress(text.encode("ascii"), mtime=0) if self._packed else text.encode("ascii"))
        offset = 0
        try:
            while offset < len(data):
                offset += self._file.write(data[offset:])
        except OSError:
            self._file.truncate(self._length)
            self._file.seek(self._length)
            raise
        self._length += len(data)
        return len(text)

    def close(self) -> None:
        self._file.close()
        super().close()


@contextlib.contextmanager
def live_line() -> Iterator[Callable[[str], None]]:
    """A context that gives a function to redraw a line on standard error, if that is a terminal."""
    console = Console(stderr=True) if sys.stderr.isatty() else Console(quiet=True)
    line = Live(console=console, auto_refresh=False, transient=True)

    def show(text: str) -> None:
        with contextlib.suppress(OSError):
            line.update(text, refresh=True)

    line.start()
    try:
        yield show
    finally:
        with contextlib.suppress(OSError):
            line.stop()


@contextlib.contextmanager
def _signals(stopped: threading.Event) -> Iterator[None]:
    """A context in which Ctrl-C, kill and a closed terminal only set `stopped`."""
    ends = [signal.SIGINT, signal.SIGTERM]
    # Windows has no SIGHUP, and nohup ignores it
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        ends.append(signal.SIGHUP)
    handlers = {number: signal.signal(number, lambda *_: stopped.set()) for number in ends}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
