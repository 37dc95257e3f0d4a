"""Simulates rides, calibrates them with the firmware's own code, and scores every estimator.

`kickstand evaluate` uses this module. The simulations run on all processors.
"""

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.poses import fit_six_positions, fit_two_positions
from kickstand_tools.calibration.procedure import fit_procedure
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.log import Log
from kickstand_tools.simulation.profiles import check_profile
from kickstand_tools.simulation.ride import SimulatedRide, ride
from numpy.typing import NDArray

from . import estimators, possible, real_ride
from .metrics import LeanScore, score


@dataclass(frozen=True)
class Job:
    """One ride to simulate."""

    profile: str  # profile of the ride
    seed: int  # seed of the ride. The seed also sets the signs of the next two errors.
    seconds: float = 640.0  # riding time
    upright_error_deg: float = 0.0  # error of the upright pose
    pitch_change_deg: float = 1.0  # change of pitch between the two poses
    traces: bool = False  # True to keep the leans


@dataclass
class Result:
    """The result of a simulated ride."""

    job: Job  # the ride
    scores: dict[str, LeanScore] = field(default_factory=dict)  # score of each estimator, by its name
    # "time" in s, and the leans in degrees: "true" and each estimator. Shape (N) each. Empty unless the job keeps the
    # leans.
    traces: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    refusal: str | None = None  # the firmware's reason for refusing the poses, or None


def jobs(profiles: list[str], seeds: int, traces: bool = False, **each: float) -> list[Job]:
    """Return one Job for each profile and seed.

    profiles: Names of the profiles.
    seeds: Number of seeds, from 0.
    traces: True to keep the leans of the rides with the first seed.
    each: Other fields of all jobs.

    Raises InputError for an unknown profile.
    """
    for name in profiles:
        check_profile(name)
    return [Job(name, seed, traces=traces and seed == 0, **each) for seed in range(seeds) for name in profiles]


@dataclass
class Evaluation:
    """The results of all rides."""

    results: list[Result]  # results of the simulated rides, ordered by profile and then by seed
    recorded: real_ride.RecordingScores | None  # scores on the recorded ride, or None without a recording


def evaluate(jobs: list[Job], recording: Path | None = None, done: Callable[[], None] = lambda: None) -> Evaluation:
    """Simulate and score every ride on all processors. Also score the estimators on a recording, if there is one.

    done: function that is called after each ride. Raises InputError if the recording cannot be used.
    """
    profiles = list(dict.fromkeys(job.profile for job in jobs))
    recorded = real_ride.compare(recording) if recording else None
    results = []
    for result in run_all(jobs):
        results.append(result)
        done()
    return Evaluation(sorted(results, key=lambda r: (profiles.index(r.job.profile), r.job.seed)), recorded)


def run(job: Job) -> Result:
    """Simulate a ride, calibrate it, run every estimator over it, and score their leans.

    The calibration uses one log of the six positions, and the two poses.
    """
    upright_sign, pitch_sign = (1, -1)[job.seed % 2], (1, -1)[job.seed // 2 % 2]
    simulated = ride(
        job.profile, job.seed, job.seconds, upright_sign * job.upright_error_deg, pitch_sign * job.pitch_change_deg
    )
    try:
        calibration = calibrated_by_log(simulated)
    except InputError as error:
        return Result(job, refusal=str(error))
    leans = estimators.estimate(as_log(simulated), calibration) | possible.leans(simulated)
    scores = {name: score(lean, simulated.truth, simulated.rate_hz) for name, lean in leans.items()}
    traces = {"time": simulated.time, "true": simulated.truth["lean_deg"], **leans} if job.traces else {}
    return Result(job, scores, traces)


def run_all(jobs: list[Job]) -> Iterator[Result]:
    """Yield the result of run() for each job, as soon as it is ready."""
    yield from on_all_processors(run, jobs, ordered=False)


def on_all_processors(function: Callable, jobs: list, chunk: int = 1, ordered: bool = True) -> Iterator:
    """Yield function(job) for each job, computed on all processors.

    ordered: True yields the results in the order of the jobs, False as soon as they are ready.
    """
    with multiprocessing.Pool(min(len(jobs), os.cpu_count() or 1), _begin_worker) as pool:
        yield from (pool.imap if ordered else pool.imap_unordered)(function, jobs, chunk)
        # Do not stop the workers with SIGTERM. A worker that receives SIGTERM before _begin_worker() would hang
        pool.close()
        pool.join()


def calibrated_by_poses(made: SimulatedRide) -> CalibrationFile:
    """Calibrate a ride like `kickstand calibrate six` and `two`, with one log per pose.

    Raises InputError if the poses are refused.
    """
    seven = [Log.from_readings(pose, made.rate_hz, f"POSE_{k}.csv") for k, pose in enumerate(made.poses, 1)]
    return _aligned(made, fit_six_positions(seven).calibration)


def calibrated_by_log(made: SimulatedRide) -> CalibrationFile:
    """Calibrate a ride like `kickstand calibrate six` and `two`, with one log of all six positions as on the board.

    Raises InputError if the poses are refused.
    """
    return _aligned(made, fit_procedure(Log.from_readings(made.procedure, made.rate_hz, "SIX.csv")).calibration)


def _aligned(made: SimulatedRide, six: CalibrationFile) -> CalibrationFile:
    kickstand = Log.from_readings(made.kickstand, made.rate_hz, "KICKSTAND.csv")
    upright = Log.from_readings(made.upright, made.rate_hz, "UPRIGHT.csv")
    return fit_two_positions(kickstand, upright, six).calibration


def as_log(made: SimulatedRide) -> Log:
    """Return the ride as the log that a reader of its file would return."""
    readings = made.readings
    return Log(made.time, readings[:, :3], readings[:, 4:], temperature_c=readings[:, 3], name="RIDE.csv")


def _begin_worker() -> None:
    """Prepare a worker process.

    Close standard error, because every worker would print a traceback after Ctrl-C. Restore the default handler of
    SIGTERM, which ends the worker at once. The command's handler, which the worker inherits, would wait for a lock.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    sys.stderr = open(os.devnull, "w", encoding="utf-8")
