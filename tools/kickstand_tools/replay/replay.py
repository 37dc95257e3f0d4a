"""Replays a recorded log with the firmware's own LeanMeter on one of several engines, block by block."""

import contextlib
import struct
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from ..calibration.file import CalibrationFile
from ..common import plugins, unix_port
from ..common.errors import InputError
from ..common.messages import Message
from ..logs.csv_lines import write_lean
from ..logs.log import Block, Table, within
from ..logs.reader import Source, read_blocks, read_twice, split_stretch
from ..logs.source import Progress
from ..signals import Array
from . import replay_engine
from .meter_along import MeterAlong, Misfit

_RESULT_BYTES = struct.calcsize(replay_engine.RESULT)

# A function that runs replay_engine.run() on another Python. Its arguments are the records and the progress function.
# The function returns a context that yields a file with the results, and may raise InputError
Engine = Callable[[Iterator[bytes], Progress | None], contextlib.AbstractContextManager[IO[bytes]]]

_SIGMA = replay_engine.COLUMNS.index("lean_sigma_deg")


@dataclass(eq=False)
class LeanTable(Table):
    """The board's results for a log of n samples. Each array has shape (n). A lean is positive to the right.

    All values except t_s are NaN for frozen readings.

    t_s: Seconds since the first sample.
    lean_deg: The meter's lean. The display shows this lean if lean_sigma_deg is not NaN.
    lean_formula_deg: Lean by Nicolae's equations (25) and (26).
    left_g: Specific force to the left.
    up_g: Specific force upward along the bike.
    forward_g: Specific force forward.
    static_lean_deg: Lean of a vehicle at rest with this force.
    yaw_rate_dps: Rate about the bike's up axis.
    roll_rate_dps: Rate about the forward axis.
    lean_sigma_deg: The firmware's standard deviation of the lean. NaN if the display shows no lean.
    notices: Remarks about the ride.
    """

    t_s: Array
    lean_deg: Array
    lean_formula_deg: Array
    left_g: Array
    up_g: Array
    forward_g: Array
    static_lean_deg: Array
    yaw_rate_dps: Array
    roll_rate_dps: Array
    lean_sigma_deg: Array
    notices: list[Message]


class CarReplayed(Message):
    """The log is from a car. A car's display shows no lean."""

    code = "car-replayed"
    text = (
        "the calibration is a car's, whose display shows no lean: lean_deg is that of a motorcycle with the same "
        "readings, and lean_sigma_deg is nan"
    )


def replay(
    log: Source, calibration: CalibrationFile, engine: str = "cpython", progress: Progress | None = None
) -> LeanTable:
    """Run the firmware's own lean meter over a recorded log.

    log: The log, see read_log().
    calibration: Calibration of the sensor.
    engine: "cpython", "micropython" (its unix port) or "rp2040" (an emulated Pico, slow).
    progress: Function that is called with (done, total).

    Raises InputError if the log cannot be used, and if the engine is not installed.

    >>> from kickstand_tools.api import Log, fit_two_positions, simulate_ride
    >>> ride = simulate_ride("street", seed=1, seconds=30.0)
    >>> poses = [Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright)]
    >>> calibration = fit_two_positions(*poses).calibration
    >>> lean = replay(Log.from_readings(ride.readings, ride.rate_hz), calibration)
    >>> float(abs(lean.lean_deg - ride.truth["lean_deg"]).max()) < 10.0
    True
    """
    notices: list[Message] = []
    blocks = [(block.t_s, results) for block, results in replay_blocks(log, calibration, engine, progress, notices)]
    time_s, columns = (np.concatenate(parts) for parts in zip(*blocks))
    return LeanTable(time_s, *columns.T, notices=notices)


def replay_to_csv(
    log: Source, calibration: CalibrationFile, engine: str, out: Path, progress: Progress | None = None
) -> tuple[int, list[Message]]:
    """Replay a log and write LEAN.csv. Its columns are the log's own times, then replay_engine.COLUMNS.

    Memory does not grow with the length of the log, except with the engine rp2040, which is too slow for long logs.

    Returns the number of samples and the notices. Raises InputError if the log cannot be used.
    """
    notices: list[Message] = []
    rows = replay_blocks(log, calibration, engine, progress, notices)
    return write_lean(out, replay_engine.COLUMNS, [5] * len(replay_engine.COLUMNS), rows), notices


def replay_blocks(
    log: Source, calibration: CalibrationFile, engine: str, progress: Progress | None, notices: list[Message]
) -> Iterator[tuple[Block, Array]]:
    """Yield each block of the log with the engine's results, one column per replay_engine.COLUMNS.

    Frozen readings are a gap for the engine, and their results are NaN. For a car, lean_sigma_deg is always NaN,
    because a car's display shows no lean. At the end, remarks are appended to notices.
    """
    car = calibration.vehicle == "car"
    whole, stretch = split_stretch(log)
    misfit = Misfit()
    for block, results in _replayed(whole, calibration, engine, progress, notices):
        if not car:
            misfit.add(block.t_s[~block.frozen], results[:, _SIGMA] == replay_engine.ODD)
        found = _with_frozen(block, results)
        if car:
            found[:, _SIGMA] = np.nan
        yield from within(stretch, block, found)
    notices += [CarReplayed()] if car else misfit.remarks(notices)


def _replayed(
    log: Source, calibration: CalibrationFile, engine: str, progress: Progress | None, notices: list[Message]
) -> Iterator[tuple[Block, Array]]:
    """Yield each block with the results for its rows that are not frozen, one column per replay_engine.COLUMNS."""
    log = read_twice(log) if engine in _BY_RECORDS else log
    shown = None if engine == "rp2040" else progress
    blocks = read_blocks(log, 2, shown, notices, calibration=calibration)
    if engine == "cpython":
        meter = MeterAlong(calibration)
        return ((block, meter.columns(block.measured)) for block in blocks)
    run = _BY_RECORDS[engine] or plugins.part(plugins.ENGINES, engine)
    return _by_records(run(_records(read_blocks(log, lines=False), calibration), progress), blocks)


def _with_frozen(block: Block, results: Array) -> Array:
    """Add rows of NaN for the frozen rows of the block. results: the results of all other rows."""
    found = np.full((len(block.time_us), len(replay_engine.COLUMNS)), np.nan)
    found[~block.frozen] = results
    sigma = found[:, _SIGMA]
    sigma[sigma < 0.0] = np.nan
    return found


def _by_records(
    run: contextlib.AbstractContextManager[IO[bytes]], blocks: Iterator[Block]
) -> Iterator[tuple[Block, Array]]:
    """Yield each block with its results. Another Python reads records and writes results with replay_engine.run()."""
    with run as results:
        for block in blocks:
            wanted = _RESULT_BYTES * int(np.count_nonzero(~block.frozen))
            found = results.read(wanted)
            if len(found) < wanted:
                raise InputError(f"MicroPython stopped ({_last_words(found + results.read())}): use --engine cpython")
            yield block, np.frombuffer(found, dtype="<f8").reshape(-1, len(replay_engine.COLUMNS))


@contextlib.contextmanager
def micropython(records: Iterator[bytes], _progress: Progress | None) -> Iterator[IO[bytes]]:
    """Replay on MicroPython's unix port. Yields a file with the results. Raises InputError if MicroPython is not
    installed."""
    if not unix_port.available():
        raise InputError("engine micropython has no package for this system: use --engine cpython")
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "records"
        with path.open("wb") as file:
            file.writelines(records)
        command = unix_port.command(replay_engine.__file__, str(path))
        with subprocess.Popen(command, env=unix_port.environment(), stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            yield process.stdout


# Engines on another Python. The engine rp2040, an emulated Pico, is None here, because it is in the package
# kickstand_emulator. This engine is found by its entry point in pyproject.toml
_BY_RECORDS: dict[str, Engine | None] = {"micropython": micropython, "rp2040": None}


def _last_words(traceback: bytes) -> str:
    """Return the last line of MicroPython's traceback. MicroPython prints the traceback to standard output."""
    return traceback.decode(errors="replace").strip().rpartition("\n")[2]


def _records(blocks: Iterable[Block], calibration: CalibrationFile) -> Iterator[bytes]:
    """Yield the bytes that replay_engine.run() reads."""
    numbers = *calibration.parameters(), *calibration.matrices(), calibration.delay_s()
    yield struct.pack(replay_engine.CALIBRATION, *numbers)
    for block in blocks:
        for time_us, reading, speed in block.measured.rows():
            given = speed if speed >= 0.0 else replay_engine.NO_SPEED  # NaN is not >= 0 either
            yield struct.pack(replay_engine.RECORD, time_us, *reading, given)
