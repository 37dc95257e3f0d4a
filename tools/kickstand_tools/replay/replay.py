"""Replays a recorded log with the firmware's own LeanMeter on one of several engines, part by part.

On this Python, numpy computes all values that do not depend on earlier samples, for a whole part at once. So a log of
an hour at 200 Hz takes 4.0 s instead of 7.2 s with Replay.step(). A test compares the results.
"""

import contextlib
import struct
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from kickstand.lean.meter import LeanMeter

from ..calibration.file import CalibrationFile
from ..calibration.mount import read_ride
from ..checks.log import CheckedLog
from ..common import installation
from ..common.messages import InputError, Message, Remedy, is_explained, kind
from ..logs.csv_text import write_lean
from ..logs.log import Log, Source, Table
from ..logs.reader import time_texts
from ..logs.source import Progress
from ..signals import Array, Bools
from . import replay_engine
from .replay_engine import NOT_SHOWN, ODD, Replay

_RESULT_BYTES = struct.calcsize(replay_engine.RESULT)

# A function that runs replay_engine.run() on another Python. Its arguments are the records and the progress function.
# The function returns a context that yields a file with the results, and may raise InputError
Engine = Callable[[Iterator[bytes], Progress | None], contextlib.AbstractContextManager[IO[bytes]]]

_SIGMA = replay_engine.COLUMNS.index("lean_sigma_deg")


@dataclass(eq=False)
class LeanTable(Table):
    """The board's results for a log of n samples. Each array has shape (n). A lean is positive to the right.

    All values except t_s are NaN for frozen readings.

    t_s: seconds since the first sample.
    lean_deg: the meter's lean. The display shows this lean if lean_sigma_deg is not NaN.
    lean_formula_deg: lean by Nicolae's equations (25) and (26).
    left_g, up_g, forward_g: specific force along the bike's axes.
    static_lean_deg: lean of a vehicle at rest with this force.
    yaw_rate_dps, roll_rate_dps: rates about the bike's up and forward axes.
    lean_sigma_deg: the firmware's standard deviation of the lean. NaN if the display shows no lean.
    notices: remarks about the ride.
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

    log: see read_log().
    engine: "cpython", "micropython" (its unix port) or "rp2040" (an emulated Pico, slow).
    progress: called with (done, total).

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
    """Replay a log and write LEAN.csv: the log's own times, then replay_engine.COLUMNS. Returns the number of samples
    and the notices. Raises InputError if the log cannot be used."""
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

        Frozen readings are a gap for the engine. Their results are NaN, and the lean_sigma_deg of a car.
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
        notices = self._ride.notices
        return [*notices, *([CarReplayed()] if self._car else self._misfit.remarks(notices))]

    def _results(self) -> Iterator[Array]:
        """Yield the values of COLUMNS for each measured stretch. Raises InputError if MicroPython stops."""
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
        flags = calibration.six_done, calibration.aligned, bool(calibration.vehicle)
        numbers = *calibration.parameters(), *calibration.matrices(), *flags, calibration.delay_s()
        yield struct.pack(replay_engine.CALIBRATION, *numbers)
        for _, part in self._ride.log.parts(self._ride.measured):
            for time_us, reading, speed in part.rows():
                has_speed = speed >= 0.0  # False for NaN
                yield struct.pack(
                    replay_engine.RECORD, time_us, *reading, speed if has_speed else replay_engine.NO_SPEED
                )


@contextlib.contextmanager
def micropython(records: Iterator[bytes], _progress: Progress | None) -> Iterator[IO[bytes]]:
    """An Engine on MicroPython's unix port. Raises InputError if it is not installed."""
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
    """The last line of the traceback, which MicroPython prints to standard output."""
    return traceback.decode(errors="replace").strip().rpartition("\n")[2]


# On this Python

# Smallest square of a force, in g^2, that has a direction, as in kickstand.lean. In free fall the force is smaller
TOO_SMALL = 0.01


class MeterAlong(Replay):
    """A Replay of parts of a log. Pass all parts in order to columns() or to after_each()."""

    def __init__(self, calibration: CalibrationFile) -> None:
        super().__init__(calibration.to_firmware(), delay_s=calibration.delay_s())

    def in_vehicle(self, log: Log) -> tuple[list[Array], list[Array]]:
        """Return force in g and rate in rad/s along left, up and forward, each as three arrays of shape (n)."""
        force, rate = self.meter.in_vehicle(log.readings.T)
        return force, rate

    def after_each(self, log: Log, force: list[Array], rate: list[Array]) -> Iterator[LeanMeter]:
        """Yield the meter after each sample of a part. force, rate: from in_vehicle()."""
        # Use the tuples of zip(), not lists of lists: they save time in Python's garbage collector
        forces, rates = (zip(*(axis.tolist() for axis in vector)) for vector in (force, rate))
        return self.follow(zip(log.time_us.tolist(), forces, rates, log.speed_mps.tolist()))

    def columns(self, log: Log) -> Array:
        """The results of Replay.step() for all samples of a part, one column per replay_engine.COLUMNS."""
        force, rate = self.in_vehicle(log)
        leans, variances = [], []
        for meter in self.after_each(log, force, rate):
            leans.append(meter.lean_deg)
            variances.append(meter.filter.variance if meter.trusted else ODD if meter.odd else NOT_SHOWN)
        variance = np.array(variances)
        return np.column_stack(
            (
                leans,
                formula_lean_deg(force[0], force[1], rate[1]),
                *force,
                static_lean_deg(force[0], force[1]),
                np.degrees(rate[1]),
                np.degrees(rate[2]),
                np.where(variance >= 0.0, np.degrees(np.sqrt(np.maximum(variance, 0.0))), variance),
            )
        )


ReadingsMisfit = kind(
    "readings-misfit",
    "seconds first_s",  # total duration of the meter's reports, time of the first one
    "the readings repeatedly contradict each other, first at {first_s:.0f} s, {seconds:.0f} s in all; the board shows "
    "no lean there",
    Remedy("is the sensor's mount loose, or the sensor faulty?"),
)


@dataclass
class Misfit:
    """Adds up the time in which the meter reports contradicting readings."""

    first_s: float = 0.0  # time of the first report
    seconds: float = 0.0  # total duration of the reports

    def add(self, t_s: Array, odd: Bools) -> None:
        """Add the times of a part of the ride, and whether the meter reports contradicting readings, shape (n)."""
        if np.any(odd):
            self.first_s = self.first_s if self.seconds else float(t_s[np.argmax(odd)])
            self.seconds += float(np.sum(np.diff(t_s, prepend=t_s[0])[odd])) or 1e-6

    def remarks(self, notices: Iterable[Message]) -> list[Message]:
        """The notice about contradicting readings, unless one of the notices explains them."""
        if not self.seconds or is_explained(notices):
            return []
        return [ReadingsMisfit(self.seconds, self.first_s)]


def static_lean_deg(left: Array, up: Array) -> Array:
    """The lean of a standing bike by Nicolae's equation (21), in degrees, positive to the right."""
    return np.degrees(np.arctan2(left, up))


def formula_lean_deg(left: Array, up: Array, yaw_rate: Array) -> Array:
    """The lean by each single reading and Nicolae's equations (25) and (26), in degrees, positive to the right.

    kickstand.lean.bike_model does the same for one reading.
    """
    square = left * left + up * up
    size = np.sqrt(np.maximum(0.0, square - 1.0))
    sine = (left - np.sign(yaw_rate) * size * up) / np.maximum(square, TOO_SMALL)
    return np.where(square < TOO_SMALL, 0.0, np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0))))
