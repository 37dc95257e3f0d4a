"""A ride streamed from the board over USB into a log, while its display goes on."""

import binascii
import contextlib
import gzip
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from mpremote.transport_serial import SerialTransport

from ..calibration.file import CalibrationFile, write_calibration
from ..deploy.board_console import BrokenOff, lines
from ..deploy.connection import connected, refuse_unfit_firmware, restart
from ..errors import InputError, cause
from ..logs.cells import TRACK
from ..output import check_output, write_whole
from ..replay.replay_engine import ReplayMeter
from . import ride_log
from .block_reader import BadBlock, Block, missing_note, parse

# The app with its turns sent over USB, its display and button alive; Ctrl-C ends it.
_START = """
from kickstand import devices, settings
from kickstand.app import App
from kickstand.board import port
from kickstand.rides.usb_stream import RideStream
chosen = settings.load()
try:
    App(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen), RideStream()).run()
except KeyboardInterrupt:
    port.rest_watchdog()
"""
_SILENT_S = 60.0  # an emulated board takes a while to start; one without a sensor says nothing either


@dataclass(frozen=True)
class LiveReading:
    """At the end of a block of half a second. lean_deg: > 0 to the right, None before the first alignment.  forward_g:
    of the specific force.  rate_hz: readings a second.  seconds: since the recording began."""

    lean_deg: float | None
    forward_g: float
    rate_hz: float
    seconds: float


@dataclass(frozen=True)
class RecordResult:
    """log, calibration: the files.  seconds, readings: how much there is.  notes: a line for each thing that the
    recording lacks."""

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
    """Write readings to the log `out`, and NAME.cal.json beside it, until Ctrl-C; then restart the board.

    Neither takes the place of a file: what was ridden before cannot be ridden again. port: None takes the only board
    that is plugged in.  begin: called with the port's name when readings are about to come.  live: called every half
    second.  Raises InputError, NoFirmware, OutdatedFirmware.
    """
    if not out.name.endswith((".csv", ".csv.gz")):
        raise InputError(f"{out}: give --out a name that ends in .csv or .csv.gz")
    check_output(out, [])
    beside = ride_log.calibration_path(out)
    for path in (out, beside):
        if path.exists():
            raise InputError(f"{path} is there already: give --out another name")
    with connected(port) as (transport, name):
        try:
            if begin:
                begin(name)
            recorded = _Recording(live)
            notes: list[str] = []
            write_whole(out, lambda temporary: recorded.write(temporary, _blocks(transport, name, notes), notes))
            assert recorded.first
            write_calibration(beside, ride_log.calibration(recorded.first))
        finally:
            with contextlib.suppress(Exception):  # the cable may be out
                restart(transport)
    return RecordResult(out, beside, recorded.seconds, recorded.count, notes)


class _Recording:
    """Blocks into a file. first: the first block; seconds, count: how much there is."""

    def __init__(self, live: Callable[[LiveReading], None] | None) -> None:
        self.first: Block | None = None
        self.seconds = 0.0
        self.count = 0
        self._live = live

    def write(self, path: Path, blocks: Iterator[Block], notes: list[str]) -> None:
        """All of them as they come. notes: gets a line for each thing that is missing."""
        missing, expected, before = 0, 0, 0
        missing_s: list[float] = []
        meter = ReplayMeter(CalibrationFile().to_firmware())
        opened = gzip.open if path.suffix == ".gz" else open
        aligned = False
        with opened(path, "wt", encoding="ascii", newline="") as file:
            file.write(",".join(ride_log.header(TRACK)) + "\n")
            for block in blocks:
                if self.first is None or block.body != self.first.body:
                    if self.first:
                        notes.append("the board's calibration has changed: the log ends here")
                        break
                    self.first = block
                    calibration = ride_log.calibration(block)
                    meter, aligned = ReplayMeter(calibration.to_firmware()), calibration.aligned
                    before = block.time_us
                missing += block.sequence - expected
                expected = block.sequence + 1
                missing_s += block.missing_s()
                for row, turn in zip(
                    ride_log.rows([block], TRACK, self.first.time_us), block.turns, strict=True
                ):
                    file.write(",".join(row) + "\n")
                    reading = [float(cell) for cell in row[1:7]]
                    meter.update((*reading[:3], 0.0, *reading[3:]), turn.time_us - before)
                    before = turn.time_us
                self.count += len(block.turns)
                self.seconds = (before - self.first.time_us) / 1e6
                if self._live:
                    rate_hz = len(block.turns) * 1e6 / max(1, before - block.time_us)
                    lean_deg = meter.lean_deg if aligned else None
                    self._live(LiveReading(lean_deg, meter.smooth_force[2], rate_hz, self.seconds))
        if self.first is None:
            raise InputError("; ".join(["nothing was recorded: does the display show readings?", *notes]))
        if missing:
            notes.append(f"{missing} blocks of half a second did not arrive: the log has gaps")
        if missing_s:
            notes.append(missing_note(missing_s))


def _blocks(transport: SerialTransport, name: str, notes: list[str]) -> Iterator[Block]:
    """Whole blocks as the board says them, until Ctrl-C here or the connection is lost."""
    parts: list[bytes] = []
    for line in _lines(transport, name, notes):
        if line != b".":
            parts.append(line)
            continue
        with contextlib.suppress(BadBlock, binascii.Error):  # its number will be missing
            yield parse(b"".join(binascii.a2b_base64(part) for part in parts))
        parts = []


def _lines(transport: SerialTransport, name: str, notes: list[str]) -> Iterator[bytes]:
    """What the app on the board prints, line by line. What ends it here becomes a Ctrl-C there."""
    stopped = threading.Event()
    before = {number: signal.signal(number, lambda *_: stopped.set()) for number in _ends()}
    try:
        yield from lines(transport, _START, _SILENT_S, stopped)
        if not stopped.is_set():
            notes.append(f"{name}: the board stopped by itself: what came until then is kept")
    except OSError as error:
        notes.append(f"{name}: connection lost ({cause(error)}): what came until then is kept")
    except BrokenOff as error:
        refuse_unfit_firmware(str(error), name)
        notes.append(f"{name}: {error}: what came until then is kept")
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _ends() -> list[signal.Signals]:
    """What ends a recording: Ctrl-C, kill, a closed terminal (not of Windows; not after nohup)."""
    ends = [signal.SIGINT, signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        ends.append(signal.SIGHUP)
    return ends
