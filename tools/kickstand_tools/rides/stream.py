"""Reads a ride that a board streams over USB, writes it to a log, and computes the lean. The display keeps working."""

import binascii
import contextlib
import gzip
import inspect
import io
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import TextIOBase
from pathlib import Path
from typing import NamedTuple

from ..calibration.file import write_calibration
from ..common.messages import InputError, cause
from ..common.output import check_output, whole_file
from ..deploy.connection import (
    BrokenOff,
    ConnectedBoard,
    connected,
    printed_lines,
    refuse_unfit_firmware,
    restart,
)
from ..logs.csv_text import TRACK
from ..replay.replay_engine import NO_SPEED, Replay
from . import ride_log, stream_guest
from .ride_log import BadBlock, StoredBlock, missing_note, parse

_START = inspect.getsource(stream_guest.stream) + "\nstream()\n"
_VEHICLE = b"vehicle "  # start of the first line that the board prints; base64 has no space
# Longest wait for data. An emulated board starts slowly, and a board without its sensor sends nothing
_SILENT_S = 60.0
CHANGED = "the board's calibration has changed: the log ends here"


class Moment(NamedTuple):
    """The lean and the forces at a time. Without an alignment only the time is known."""

    t_s: float  # since the start of the recording
    lean_deg: float | None  # positive to the right; None for a car and if it is too uncertain to be shown
    forward_g: float | None  # specific force
    left_g: float | None  # specific force; None for a motorcycle, because it is near 0 in a bend


@dataclass(frozen=True)
class LiveReading:
    """The readings of half a second."""

    aligned: bool
    car: bool  # True if the board is set to a vehicle that does not lean
    moments: list[Moment]  # one per turn of the board's loop
    # Maxima since the start of the recording, as on the display; 0 if the sensor is not aligned
    max_left_deg: float
    max_right_deg: float
    max_accel_g: float
    max_brake_g: float
    rate_hz: float  # turns of the board's loop per second
    seconds: float  # since the start of the recording


class StreamLog:
    """Writes blocks to a log. If a write fails, the log ends there, with a note.

    stopped: an event that ends the stream, also set here if the log must end. live: called with each LiveReading.
    first: the first block. seconds, count: duration and number of readings. written: True once the log has a block.
    """

    def __init__(self, stopped: threading.Event, live: Callable[[LiveReading], None] | None = None) -> None:
        self._stopped = stopped
        self.first: StoredBlock | None = None
        self.seconds = 0.0
        self.count = 0
        self.written = False
        self._live = live

    def write(self, file: TextIOBase, blocks: Iterator[StoredBlock], notes: list[str]) -> None:
        """Write each block when it arrives. A line is added to notes for each kind of gap or fault. Raises InputError
        if no block was written."""
        missing, expected = 0, 0
        missing_s: list[float] = []
        head = ",".join(ride_log.header(TRACK)) + "\n"
        fault = ""
        for block in blocks:
            if fault:  # ignore what the board still sends
                continue
            if self.first is None:
                self.first = block
                self._calibration = ride_log.calibration(block)
                delay_s, leans = self._calibration.delay_s(), self._calibration.vehicle != "car"
                self._replay = Replay(self._calibration.to_firmware(), delay_s, leans, block.time_us)
            rows = list(ride_log.rows([block], TRACK, self.first.time_us))
            fault = self._write_rows(file, head, rows) if block.body == self.first.body else CHANGED
            if fault:
                notes.append(fault)
                self._stopped.set()
                continue
            head, self.written = "", True
            missing += block.sequence - expected
            expected = block.sequence + 1
            missing_s += block.missing_s()
            self.count += len(block.turns)
            last_us = block.turns[-1].time_us if block.turns else block.time_us
            self.seconds = (last_us - self.first.time_us) / 1e6
            if self._live:
                rate_hz = len(block.turns) * 1e6 / max(1, last_us - block.time_us)
                self._live(self._live_reading(block, rows, rate_hz))
        if not self.written:
            raise InputError("; ".join(["nothing was recorded: does the display show readings?", *notes]))
        if missing:
            notes.append(f"{missing} blocks of half a second did not arrive: the log has gaps")
        if missing_s:
            notes.append(missing_note(missing_s))

    def _write_rows(self, file: TextIOBase, head: str, rows: list[list[str]]) -> str:
        """Write a block as a whole, because an incomplete line cannot be read. Return the fault in words, or ""."""
        try:
            file.write(head + "".join(",".join(row) + "\n" for row in rows))
            return ""
        except OSError as error:
            return f"writing the log failed ({cause(error)}): the log up to there is kept"

    def _live_reading(self, block: StoredBlock, rows: list[list[str]], rate_hz: float) -> LiveReading:
        """Compute the lean of a block as the board does. rows: the rows of the block in the log."""
        aligned, car = self._calibration.aligned, self._calibration.vehicle == "car"
        meter = self._replay.meter
        moments = []
        for row, turn in zip(rows, block.turns, strict=True):
            t_s, ax, ay, az, gx, gy, gz = map(float, row[:7])
            speed = NO_SPEED if turn.speed_mps is None else turn.speed_mps
            self._replay.take(turn.time_us, (ax, ay, az, 0.0, gx, gy, gz), speed)
            left_g, _, forward_g = meter.smooth_force
            lean_deg = None if car else meter.shown_deg()
            moments.append(Moment(t_s, lean_deg, forward_g if aligned else None, left_g if aligned and car else None))
        maxima = meter.max_left_deg, meter.max_right_deg, meter.max_accel_g, meter.max_brake_g
        maxima = maxima if aligned else (0.0, 0.0, 0.0, 0.0)
        return LiveReading(aligned, car, moments, *maxima, rate_hz, self.seconds)


def blocks(transport: ConnectedBoard, name: str, notes: list[str], stopped: threading.Event) -> Iterator[StoredBlock]:
    """Yield the complete blocks that the board sends, until `stopped` is set or the connection is lost.

    name: name of the port, "" on a page. notes: the reason is appended if the stream ends early.
    Raises InputError if the firmware on the board cannot stream.
    """
    parts: list[bytes] = []
    vehicle = ""
    for line in _lines(transport, name, notes, stopped):
        if line.startswith(_VEHICLE):
            vehicle = line.removeprefix(_VEHICLE).decode(errors="replace")  # a byte may be disturbed
            continue
        if line != b".":
            parts.append(line)
            continue
        with contextlib.suppress(BadBlock, binascii.Error):  # the missing block number will show the loss
            block = parse(b"".join(binascii.a2b_base64(part) for part in parts))
            block.vehicle = vehicle
            yield block
        parts = []


def _lines(transport: ConnectedBoard, name: str, notes: list[str], stopped: threading.Event) -> Iterator[bytes]:
    prefix = f"{name}: " if name else ""
    try:
        yield from printed_lines(transport, _START, _SILENT_S, stopped)
        if not stopped.is_set():
            notes.append(f"{prefix}the board stopped on its own: the log up to there is kept")
    except OSError as error:
        reason = f" ({cause(error)})" if name else ""  # a browser gives no cause
        notes.append(f"{prefix}connection lost{reason}: the log up to there is kept")
    except BrokenOff as error:
        refuse_unfit_firmware(str(error), name or "this port")
        notes.append(f"{prefix}{error}: the log up to there is kept")


# The log on a computer


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
    """Yield the blocks, and write the calibration of the first one."""
    for i, block in enumerate(blocks):
        if i == 0:
            write_calibration(calibration, ride_log.calibration(block))
        yield block


class _GrowingFile(io.TextIOBase):
    """A text file that contains only complete writes. If a write fails on a full disk, the earlier content stays.

    packed: True to compress with gzip, each write as a member of its own, which cannot be damaged by a later cut.
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
