"""A recorded log through the firmware's own LeanMeter, by one of several engines, block by block."""

import io
import struct
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kickstand.errors import Notice

from .. import unix_port
from ..calibration.file import CalibrationFile
from ..errors import InputError
from ..logs.block import Block
from ..logs.csv_lines import joined_cells, number_cells, text_cells, write_lines
from ..logs.reader import Source, apart, read_blocks, read_twice
from ..logs.source import Progress, total_bytes
from ..logs.stretch import Stretch, within
from ..logs.table import Array, Table
from . import replay_engine
from .meter_along import MeterAlong

_CHUNK = 500  # samples between two calls of progress while an emulated Pico works

_LONG_BYTES = 20 << 20  # of the file: a log of some seconds' work, for which a second process is worth its start

_SIGMA = replay_engine.COLUMNS.index("lean_sigma_deg")

Replayed = tuple[Block, Array]  # (n, replay_engine.COLUMNS) of the rows that are believed


@dataclass(eq=False)
class LeanTable(Table):
    """What the board would have shown: n samples, axes left, up, forward; lean > 0 to the right.

    t_s: seconds since the first sample; where the readings froze all else is NaN. lean_deg: the meter's lean,
    which is shown where lean_sigma_deg is not NaN.
    lean_formula_deg: Nicolae's (25)-(26) as it stands.
    left_g, up_g, forward_g: specific force. static_lean_deg: the lean of a vehicle at rest with this force.
    lean_sigma_deg: the standard deviation of the lean that the firmware believed in, NaN where the display shows no
    lean. notices: what is remarkable in the ride (kickstand_tools.refusals.sentence puts a notice into words).
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
    notices: list[Notice]


def replay(
    log: Source, calibration: CalibrationFile, engine: str = "cpython", progress: Progress | None = None
) -> LeanTable:
    """Run the firmware's own lean meter over a recorded log.

    log: see read_log. engine: "cpython", "micropython" (the unix port) or "rp2040" (an emulated Pico, slow). progress:
    called with how much is done of how much. Raises InputError, also where the engine is not installed.

    >>> from kickstand_tools.api import Log, fit_two_positions, simulate_ride
    >>> ride = simulate_ride("street", seed=1, seconds=30.0)
    >>> poses = [Log.from_readings(pose, ride.rate_hz) for pose in (ride.kickstand, ride.upright)]
    >>> calibration = fit_two_positions(*poses).calibration
    >>> lean = replay(Log.from_readings(ride.readings, ride.rate_hz), calibration)
    >>> float(abs(lean.lean_deg - ride.truth["lean_deg"]).max()) < 10.0
    True
    """
    notices: list[Notice] = []
    blocks = list(replay_blocks(log, calibration, engine, progress, notices))
    time_s = np.concatenate([block.t_s for block, _ in blocks])
    columns = np.concatenate([results for _, results in blocks]).T
    return LeanTable(time_s, *columns, notices=notices)


def replay_to_csv(
    log: Source, calibration: CalibrationFile, engine: str, out: Path, progress: Progress | None = None
) -> tuple[int, list[Notice]]:
    """Write LEAN.csv: the log's own times, then replay_engine.COLUMNS. Returns the number of samples and the notices.

    A long log takes two processes. Memory does not grow with it, except on the emulated Pico, which is too slow for a
    long one. Raises InputError.
    """
    count, notices = 0, []
    whole = log.source if isinstance(log, Stretch) else log
    # for the command alone: a program that calls replay() may not be one that can be started once more
    run = "two processes" if engine == "cpython" and total_bytes(whole) > _LONG_BYTES else engine

    def lines() -> Iterator[bytes]:
        nonlocal count
        for block, results in replay_blocks(log, calibration, run, progress, notices):
            count += len(results)
            yield joined_cells([text_cells(block.time_text), *(number_cells(column, 5) for column in results.T)])

    write_lines(out, ("t_s", *replay_engine.COLUMNS), lines())
    return count, notices


def replay_blocks(
    log: Source, calibration: CalibrationFile, engine: str, progress: Progress | None, notices: list[Notice]
) -> Iterator[tuple[Block, Array]]:
    """Each block of the log with the engine's results for it (n, COLUMNS), NaN where the readings froze: there the
    engine is told of a gap. A car's display shows no lean, so lean_sigma_deg is NaN throughout. notices is appended to
    at the end."""
    car = calibration.vehicle == "car"
    whole, stretch = apart(log)
    for block, results in _RUN[engine](whole, calibration, progress, notices):
        found = _with_frozen(block, results)
        if car:
            found[:, _SIGMA] = np.nan
        yield from within(stretch, block, found)
    notices += [Notice("car-replayed")] if car else []


def _table(results: bytes) -> Array:
    """(n, COLUMNS) from the bytes that replay_engine.run writes."""
    return np.frombuffer(results, dtype="<f8").reshape(-1, len(replay_engine.COLUMNS))


def _with_frozen(block: Block, results: Array) -> Array:
    """(n, COLUMNS), NaN where there is no value."""
    found = np.full((len(block.time_us), len(replay_engine.COLUMNS)), np.nan)
    found[~block.frozen] = results
    sigma = found[:, _SIGMA]
    sigma[sigma == replay_engine.NOT_SHOWN] = np.nan
    return found


def _cpython(
    log: Source, calibration: CalibrationFile, progress: Progress | None, notices: list[Notice]
) -> Iterator[Replayed]:
    meter = MeterAlong(calibration)
    for block in read_blocks(log, 2, progress, notices, calibration=calibration):
        yield block, meter.columns(block.believed)


def _two_processes(
    log: Source, calibration: CalibrationFile, progress: Progress | None, notices: list[Notice]
) -> Iterator[Replayed]:
    from . import second_process  # a browser's Python cannot import it

    return second_process.columns_of(read_blocks(log, 2, progress, notices, calibration=calibration), calibration)


def _micropython(
    log: Source, calibration: CalibrationFile, progress: Progress | None, notices: list[Notice]
) -> Iterator[Replayed]:
    if not unix_port.available():
        raise InputError("engine micropython has no package for this system: use --engine cpython")
    log, size = read_twice(log), struct.calcsize(replay_engine.RESULT)
    with tempfile.TemporaryDirectory() as directory:
        records = Path(directory) / "records"
        with records.open("wb") as file:
            file.writelines(_records(read_blocks(log), calibration))
        command = unix_port.command(replay_engine.__file__, str(records))
        with subprocess.Popen(command, env=unix_port.environment(), stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            results = b""
            for block in read_blocks(log, 2, progress, notices, calibration=calibration):
                wanted = size * int(np.count_nonzero(~block.frozen))
                results = process.stdout.read(wanted)
                if len(results) < wanted:
                    break
                yield block, _table(results)
            results += process.stdout.read()
        if process.returncode != 0:  # its traceback came over standard output
            reason = results.decode(errors="replace").strip().rpartition("\n")[2]
            raise InputError(f"MicroPython stopped ({reason}): use --engine cpython")


def _rp2040(
    log: Source, calibration: CalibrationFile, progress: Progress | None, notices: list[Notice]
) -> Iterator[Replayed]:
    from ..emulator import image

    image.find()  # says what is not installed, before the import below fails for want of it
    from . import emulated as emulated

    log, size = read_twice(log), struct.calcsize(replay_engine.RESULT)
    records = b"".join(_records(read_blocks(log), calibration))
    results, total = io.BytesIO(), len(records) // struct.calcsize(replay_engine.RECORD)

    def sink(result: bytes) -> None:
        results.write(result)
        if progress and results.tell() % (_CHUNK * size) == 0:
            progress(results.tell() // size, total)

    emulated.run(records, sink)
    results.seek(0)
    for block in read_blocks(log, notices=notices, calibration=calibration):
        wanted = size * int(np.count_nonzero(~block.frozen))
        yield block, _table(results.read(wanted))


_RUN = {"cpython": _cpython, "two processes": _two_processes, "micropython": _micropython, "rp2040": _rp2040}


def _records(blocks: Iterable[Block], calibration: CalibrationFile) -> Iterator[bytes]:
    """The bytes that replay_engine.run reads."""
    yield struct.pack(replay_engine.CALIBRATION, *calibration.parameters(), calibration.delay_s())
    for block in blocks:
        for time_us, reading, speed in block.believed.rows():
            given = speed if speed >= 0.0 else replay_engine.NO_SPEED  # NaN is not >= 0
            yield struct.pack(replay_engine.RECORD, time_us, *reading, given)
