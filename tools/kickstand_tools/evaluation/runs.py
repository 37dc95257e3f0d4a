"""Rides simulated, calibrated by the firmware's own code and scored, on all processors."""

import multiprocessing
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import calibrate
from ..calibration_file import CalibrationFile
from ..errors import InputError
from ..logs import Log
from ..simulation import Ride, ride
from ..simulation.files import write_poses
from .estimators import estimate
from .metrics import Score, score


@dataclass(frozen=True)
class Job:
    """One ride. The signs of both set-up errors change with the seed. traces: keep the leans to draw them."""

    profile: str
    seed: int
    seconds: float = 640.0
    upright_error_deg: float = 0.0
    pitch_change_deg: float = 1.0
    traces: bool = False


@dataclass
class Result:
    """scores and traces by estimator; refusal: why the calibration was refused, or None."""

    job: Job
    scores: dict[str, Score] = field(default_factory=dict)
    traces: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    refusal: str | None = None


def run(job: Job) -> Result:
    """Simulate, calibrate from the poses alone, estimate, score."""
    upright_sign, pitch_sign = (1, -1)[job.seed % 2], (1, -1)[job.seed // 2 % 2]
    made = ride(
        job.profile,
        job.seed,
        job.seconds,
        upright_sign * job.upright_error_deg,
        pitch_sign * job.pitch_change_deg,
    )
    try:
        calibration = calibrated_by_poses(made)
    except InputError as error:
        return Result(job, refusal=str(error))
    shown = estimate(as_log(made), calibration)
    scores = {name: score(lean, made.truth, made.rate_hz) for name, lean in shown.items()}
    traces = {"time": made.time, "true": made.truth["lean_deg"], **shown} if job.traces else {}
    return Result(job, scores, traces)


def run_all(jobs: list[Job]) -> Iterator[Result]:
    """run() of each, as they get done."""
    if len(jobs) == 1:
        yield run(jobs[0])
        return
    with multiprocessing.Pool(min(len(jobs), os.cpu_count() or 1), _silent) as pool:
        yield from pool.imap_unordered(run, jobs)


def calibrated_by_poses(made: Ride) -> CalibrationFile:
    """`kickstand calibrate six` and `two` over the ride's poses. Raises InputError."""
    with tempfile.TemporaryDirectory() as directory:
        seven, kickstand, upright = write_poses(Path(directory), made)
        try:
            six = calibrate.six(seven, _unheard)
            return calibrate.two(kickstand, upright, six, "left", _unheard)
        except InputError as error:
            raise InputError(str(error).replace(f"{directory}{os.sep}", "")) from error


def as_log(made: Ride) -> Log:
    """The ride as if read from its file."""
    time_us = np.round(made.time * 1e6).astype(int).tolist()
    readings = [tuple(row) for row in made.readings.tolist()]
    return Log(Path("RIDE.csv"), [], time_us, readings, [None] * len(readings))


def _unheard(line: str) -> None:
    pass


def _silent() -> None:
    sys.stderr = open(
        os.devnull, "w", encoding="utf-8"
    )  # the workers' progress bars would overwrite each other
