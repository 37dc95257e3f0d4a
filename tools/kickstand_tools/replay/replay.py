"""Replays a recorded log with the firmware's own LeanMeter on one of several engines, part by part."""

import contextlib
import struct
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from ..calibration.file import CalibrationFile
from ..calibration.mount import read_ride
from ..checks.log import CheckedLog
from ..common import installation
from ..common.messages import InputError, Message, kind
from ..logs.csv_lines import write_lean
from ..logs.log import Source, Table
from ..logs.reader import time_texts
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


CarReplayed = kind(
    "car-replayed",
    text="the calibration is a car's, whose display shows no lean: lean_deg is that of a motorcycle with the same "
    "readings, and lean_sigma_deg is nan",
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
    return replay_checked(read_ride(log, calibration), calibration, engine, progress)


def replay_checked(
    ride: CheckedLog, calibration: CalibrationFile, engine: str = "cpython", progress: Progress | None = None
) -> LeanTable:
    """Run replay() over a checked log."""
    run = _Replay(ride, calibration, engine, progress)
    columns = np.concatenate(list(run.parts()))
    return LeanTable(ride.log.t_s[ride.rows], *columns.T, notices=run.notices())


def replay_to_csv(
    log: Source, calibration: CalibrationFile, engine: str, out: Path, progress: Progress | None = None
) -> tuple[int, list[Message]]:
    """Replay a log and write LEAN.csv. Its columns are the log's own times, then replay_engine.COLUMNS.

    Returns the number of samples and the notices. Raises InputError if the log cannot be used.
    """
    ride = read_ride(log, calibration)
    run, times = _Replay(ride, calibration, engine, progress), time_texts(log, ride.log, ride.rows)
    count = write_lean(out, replay_engine.COLUMNS, [5] * len(replay_engine.COLUMNS), times, run.parts())
    return count, run.notices()


class _Replay:
    """Runs an engine over a ride part by part. Call parts(), and at its end notices()."""

    def __init__(self, ride: CheckedLog, calibration: CalibrationFile, engine: str, progress: Progress | None) -> None:
        self._ride, self._calibration, self._engine, self._progress = ride, calibration, engine, progress
        self._car, self._misfit = calibration.vehicle == "car", Misfit()

    def parts(self) -> Iterator[Array]:
        """Yield the results of successive samples of the stretch, one column per replay_engine.COLUMNS.

        Frozen readings are a gap for the engine, and their results are NaN. For a car, lean_sigma_deg is always NaN,
        because a car's display shows no lean.
        """
        log, measured = self._ride.log, self._ride.measured
        first, last, _ = self._ride.rows.indices(len(log.t_s))
        for (span, part), values in zip(log.parts(measured), self._results()):
            if not self._car:
                self._misfit.add(part.t_s, values[:, _SIGMA] == replay_engine.ODD)
            results = np.full((span.stop - span.start, len(replay_engine.COLUMNS)), np.nan)
            results[measured[span]] = values
            sigma = results[:, _SIGMA]
            sigma[(sigma < 0.0) | self._car] = np.nan
            if first < span.stop and span.start < last:
                yield results[max(0, first - span.start) : last - span.start]
            if self._progress and self._engine != "rp2040":
                self._progress(span.stop, len(log.t_s))

    def notices(self) -> list[Message]:
        """Return the remarks about the ride."""
        notices = self._ride.notices
        return [*notices, *([CarReplayed()] if self._car else self._misfit.remarks(notices))]

    def _results(self) -> Iterator[Array]:
        """Yield the results for the measured readings of each part."""
        parts = self._ride.log.parts(self._ride.measured)
        if self._engine == "cpython":
            meter = MeterAlong(self._calibration)
            yield from (meter.columns(part) for _, part in parts)
            return
        run = _BY_RECORDS[self._engine] or installation.part(installation.ENGINES, self._engine)
        with run(self._records(), self._progress) as file:
            for _, part in parts:
                size = _RESULT_BYTES * len(part.t_s)
                data = file.read(size)
                if len(data) < size:
                    words = _last_words(data + file.read())
                    raise InputError(f"MicroPython stopped ({words}): use --engine cpython")
                yield np.frombuffer(data, dtype="<f8").reshape(-1, len(replay_engine.COLUMNS))

    def _records(self) -> Iterator[bytes]:
        """Yield the bytes that replay_engine.run() reads."""
        calibration = self._calibration
        numbers = *calibration.parameters(), *calibration.matrices(), calibration.delay_s()
        yield struct.pack(replay_engine.CALIBRATION, *numbers)
        for _, part in self._ride.log.parts(self._ride.measured):
            for time_us, reading, speed in part.rows():
                has_speed = speed >= 0.0  # False for NaN
                yield struct.pack(
                    replay_engine.RECORD, time_us, *reading, speed if has_speed else replay_engine.NO_SPEED
                )


@contextlib.contextmanager
def micropython(records: Iterator[bytes], _progress: Progress | None) -> Iterator[IO[bytes]]:
    """Replay on MicroPython's unix port. Yields a file with the results. Raises InputError if MicroPython is not
    installed."""
    if not installation.has_micropython():
        raise InputError("engine micropython has no package for this system: use --engine cpython")
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "records"
        with path.open("wb") as file:
            file.writelines(records)
        command, environment = installation.micropython(replay_engine.__file__, str(path))
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            yield process.stdout


# Engines on another Python. The engine rp2040, an emulated Pico, is None here, because it is in the package
# kickstand_emulator. This engine is found by its entry point in pyproject.toml
_BY_RECORDS: dict[str, Engine | None] = {"micropython": micropython, "rp2040": None}


def _last_words(traceback: bytes) -> str:
    """Return the last line of MicroPython's traceback. MicroPython prints the traceback to standard output."""
    return traceback.decode(errors="replace").strip().rpartition("\n")[2]
