"""A ride streamed from the board over USB into a log, while its display goes on."""

import binascii
import contextlib
import gzip
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from kickstand.lean.meter import LeanMeter
from mpremote.transport_serial import SerialTransport

from ..calibration.file import CalibrationFile, write_calibration
from ..deploy.board_console import BrokenOff, lines
from ..deploy.flash import connected, refuse_absent, restart
from ..errors import InputError, cause
from ..output import check_output, write_whole
from . import ride_log
from .block_reader import BadBlock, Block, parse
from .live_line import LiveLine

Print = Callable[[str], None]

_START = "from kickstand.rides import usb_stream\nusb_stream.run()"
_SILENT_S = 60.0  # an emulated board takes a while to start; one without a sensor says nothing either


def record(port: str | None, out: Path, say: Print, warn: Print) -> None:
    """Write readings to the log `out`, and NAME.cal.json beside it, until Ctrl-C. Raises InputError.

    Neither takes the place of a file: what was ridden before cannot be ridden again.
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
            say(f"recording from {name}: Ctrl-C ends it")
            recorded = _Recording()
            notes: list[str] = []
            write_whole(out, lambda temporary: recorded.write(temporary, _blocks(transport, name, notes), notes))
            assert recorded.first
            write_calibration(beside, ride_log.calibration(recorded.first))
            for note in notes:
                warn(note)
            say(f"written: {out}, {recorded.seconds:.1f} s, {recorded.count} readings, and {beside.name}")
        finally:
            with contextlib.suppress(Exception):  # the cable may be out
                restart(transport)


class _Recording:
    """Blocks into a file. first: the first block; seconds, count: how much there is."""

    def __init__(self) -> None:
        self.first: Block | None = None
        self.seconds = 0.0
        self.count = 0

    def write(self, path: Path, blocks: Iterator[Block], notes: list[str]) -> None:
        """All of them as they come, with the lean live where someone is watching. notes: what is to be said of it."""
        missing, expected, before = 0, 0, 0
        meter = LeanMeter(CalibrationFile().to_firmware())
        opened = gzip.open if path.suffix == ".gz" else open
        aligned = False
        with opened(path, "wt", encoding="ascii", newline="") as file, LiveLine() as live:
            file.write(",".join(ride_log.header(speed=True)) + "\n")
            for block in blocks:
                if self.first is None or block.body != self.first.body:
                    if self.first:
                        notes.append("the board's calibration has changed: the log ends here")
                        break
                    self.first = block
                    calibration = ride_log.calibration(block)
                    meter, aligned = LeanMeter(calibration.to_firmware()), calibration.aligned
                    before = block.time_us
                missing += block.sequence - expected
                expected = block.sequence + 1
                for row, turn in zip(
                    ride_log.rows([block], True, self.first.time_us), block.turns, strict=True
                ):
                    file.write(",".join(row) + "\n")
                    reading = [float(cell) for cell in row[1:7]]
                    meter.update((*reading[:3], 0.0, *reading[3:]), turn.time_us - before)
                    before = turn.time_us
                self.count += len(block.turns)
                self.seconds = (before - self.first.time_us) / 1e6
                if live.watched:
                    span_s = (before - block.time_us) / 1e6
                    live.show(_status(meter if aligned else None, self, len(block.turns) / span_s))
        if self.first is None:
            raise InputError("; ".join(["nothing was recorded: does the display show readings?", *notes]))
        if missing:
            notes.append(f"{missing} blocks of half a second did not arrive: the log has gaps")


def _status(meter: LeanMeter | None, recorded: _Recording, rate: float) -> str:
    """The live line. meter: None before the first alignment, when there is no lean."""
    how_long = f"{rate:3.0f} readings/s  {recorded.seconds // 60:.0f}:{recorded.seconds % 60:04.1f}"
    if meter is None:
        return f"not aligned  {how_long}"
    lean, forward = meter.lean_deg, meter.smooth_force[2]
    bar = "#" * min(20, round(abs(lean) / 3))
    picture = f"{bar if lean < 0 else '':>20}|{bar if lean > 0 else '':<20}"
    return f"{picture} lean {lean:+5.1f} deg  forward {forward:+.2f} g  {how_long}"


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
        refuse_absent(str(error), name)
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
