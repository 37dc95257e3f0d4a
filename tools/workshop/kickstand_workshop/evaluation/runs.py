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
from kickstand.units import STANDARD_GRAVITY
from kickstand_sim.simulation.profiles import check_profile
from kickstand_sim.simulation.ride import SimulatedRide, ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.mount import read_ride
from kickstand_tools.calibration.poses import fit_procedure, fit_six_positions, fit_two_positions
from kickstand_tools.common.messages import InputError, Message
from kickstand_tools.estimation.alignment import fit_ride
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from kickstand_tools.signals import moving_mean, peak_offset
from numpy.typing import NDArray

from . import estimators
from .estimators import calibrated, estimate

AVERAGE_S = 1.0
_RIDING_MPS = 2.0  # smallest speed of samples that are scored
_LEANED_DEG = 5.0  # smallest lean for the fit of the slope. The reference is rarely over 10 degrees


@dataclass
class RealScore:
    """The errors of a lean against the rough reference."""

    rms_deg: float  # root of the mean square of the error
    slope: float  # shown lean divided by reference lean, for reference leans over 5 degrees


@dataclass
class RecordingScores:
    """The scores of all estimators on a recording."""

    name: str  # name of the recording's file
    scores: dict[str, RealScore]  # score of each estimator, by its name
    # Remarks about the recording, and about readings that contradict its calibration
    notices: list[Message] = field(default_factory=list)


def score_recording(path: Path) -> RecordingScores:
    """Run every estimator over a recorded ride with speed. Raises InputError if the recording cannot be used."""
    log = read_log(path)
    speed, calibration = _speed(log), fit_ride(log).calibration
    reference = reference_lean(log, calibration)
    riding = speed > _RIDING_MPS
    scores = {
        name: RealScore(rms((lean - reference)[riding]), slope(lean[riding], reference[riding], _LEANED_DEG))
        for name, lean in estimate(log, calibration).items()
    }
    return RecordingScores(path.name, scores, read_ride(log, calibration).notices)


def reference_lean(log: Log, calibration: CalibrationFile) -> NDArray[np.float64]:
    """Compute the reference lean atan(v * yaw rate / g), averaged over 1 s, in degrees; positive to the right.

    It is too small: the speed changes only once per second, tyres are wide, and the up axis leans with the bike. It
    also ignores slope and bank of the road. Use it to compare methods only.
    """
    samples = calibrated(log, calibration)
    centripetal = _speed(log) * np.radians(samples.rate[:, 1])
    lean = -np.degrees(np.arctan(centripetal / STANDARD_GRAVITY))
    return moving_mean(lean, round(AVERAGE_S * samples.rate_hz))


def _speed(log: Log) -> NDArray[np.float64]:
    has_speed = ~np.isnan(log.speed_mps)
    if np.count_nonzero(has_speed) < 2:
        raise InputError(f"{log.name} has no speed: without it there is no reference")
    return np.interp(log.t_s, log.t_s[has_speed], log.speed_mps[has_speed])


LEANED_DEG = 10.0  # smallest true lean for the fit of the slope, because most of a ride is nearly upright
_LAG_RANGE_S = (-0.2, 0.8)  # smallest and largest lag to try
_LAG_SMOOTHING_S = 0.05
_STILL_DPS = 1.0  # no lag is computed if the true roll rate has a smaller rms
# On a straight, yaw rate and lean stay below the first two limits and the speed above the third. A straight lasts
# _STRAIGHT_S or longer
_STRAIGHT_DPS, _STRAIGHT_DEG, _STRAIGHT_MPS, _STRAIGHT_S = 2.0, 6.0, 5.0, 1.0


@dataclass
class LeanScore:
    """The errors of a shown lean. A figure is NaN if the ride does not determine it."""

    rms_deg: float  # root of the mean square of the error
    p95_deg: float  # 95th percentile of the absolute error
    worst_deg: float  # largest absolute error
    slope: float  # shown lean divided by true lean
    lag_ms: float  # delay of the shown lean. Positive if the lean is late.
    straight_bias_deg: float  # mean error on straights in the last tenth of the ride


def rms(error: NDArray) -> float:
    return float(np.sqrt(np.mean(error * error)))


def slope(lean: NDArray, true: NDArray, beyond: float = LEANED_DEG) -> float:
    """Fit a line through the origin to the shown lean over the true lean. Returns its slope, or NaN without samples.

    beyond: only samples with a larger true lean are used, in degrees.
    """
    leaned = np.abs(true) > beyond
    square = float(np.sum(true[leaned] ** 2))
    return float(np.sum(lean[leaned] * true[leaned]) / square) if square > 0.0 else float("nan")


def lag_ms(lean: NDArray, true: NDArray, rate_hz: float) -> float:
    """Find the delay in ms at which the shown roll rate correlates best with the true one. NaN if there is none."""
    width = max(round(_LAG_SMOOTHING_S * rate_hz), 1)
    window = np.full(width, 1.0 / width)
    a, b = (np.convolve(np.gradient(x) * rate_hz, window, mode="same") for x in (lean, true))
    if float(np.std(b)) < _STILL_DPS:
        return float("nan")
    shifts = np.arange(round(_LAG_RANGE_S[0] * rate_hz), round(_LAG_RANGE_S[1] * rate_hz) + 1)
    edge = int(np.max(np.abs(shifts)))
    inner = b[edge : len(b) - edge]
    match = np.array([a[edge + k : len(a) - edge + k] @ inner for k in shifts])
    best = int(np.argmax(match))
    if not 0 < best < len(shifts) - 1:
        return float("nan")
    return float((shifts[best] + peak_offset(match[best - 1 : best + 2])) / rate_hz * 1000.0)


def straights(truth: dict[str, NDArray], rate_hz: float) -> NDArray[np.bool_]:
    """Return True where the bike has ridden straight ahead for at least a second at over 5 m/s, shape (n)."""
    is_straight = (
        (np.abs(truth["yaw_rate_dps"]) < _STRAIGHT_DPS)
        & (np.abs(truth["lean_deg"]) < _STRAIGHT_DEG)
        & (truth["speed_mps"] > _STRAIGHT_MPS)
    )
    since = np.arange(len(is_straight)) - np.maximum.accumulate(np.where(is_straight, -1, np.arange(len(is_straight))))
    return since > _STRAIGHT_S * rate_hz


def score(lean: NDArray, truth: dict[str, NDArray], rate_hz: float) -> LeanScore:
    """Score a shown lean after the bike sets off, or without its first second if the bike never sets off.

    lean: lean in degrees, shape (N).
    truth: lean_deg, speed_mps and yaw_rate_dps, each of shape (N).
    """
    off = truth["speed_mps"] > 0.5
    first = int(np.argmax(off)) if off.any() else round(rate_hz)
    true = truth["lean_deg"]
    error = (lean - true)[first:]
    late = straights(truth, rate_hz)
    late[: round(0.9 * len(late))] = False
    return LeanScore(
        rms_deg=rms(error),
        p95_deg=float(np.percentile(np.abs(error), 95.0)),
        worst_deg=float(np.max(np.abs(error))),
        slope=slope(lean[first:], true[first:]),
        lag_ms=lag_ms(lean[first:], true[first:], rate_hz),
        straight_bias_deg=float(np.mean((lean - true)[late])) if late.any() else float("nan"),
    )


@dataclass(frozen=True)
class Job:
    """One ride to simulate."""

    profile: str  # profile of the ride
    seed: int  # seed of the ride. The seed also sets the signs of the next two errors.
    seconds: float = 640.0  # riding time
    upright_error_deg: float = 0.0  # error of the upright pose
    pitch_change_deg: float = 1.0  # change of pitch between the two poses


@dataclass
class Result:
    """The result of a simulated ride."""

    job: Job  # the ride
    scores: dict[str, LeanScore] = field(default_factory=dict)  # score of each estimator, by its name
    refusal: str | None = None  # the firmware's reason for refusing the poses, or None


def jobs(profiles: list[str], seeds: int, **each: float) -> list[Job]:
    """Return one Job for each profile and seed from 0 on. Raises InputError for an unknown profile.

    each: Other fields of all jobs.
    """
    for name in profiles:
        check_profile(name)
    return [Job(name, seed, **each) for seed in range(seeds) for name in profiles]


@dataclass
class Evaluation:
    """The results of all rides."""

    results: list[Result]  # results of the simulated rides, ordered by profile and then by seed
    recorded: RecordingScores | None  # scores on the recorded ride, or None without a recording


def evaluate(jobs: list[Job], recording: Path | None = None, done: Callable[[], None] = lambda: None) -> Evaluation:
    """Simulate and score every ride on all processors. Also score the estimators on a recording, if there is one.

    done: function that is called after each ride. Raises InputError if the recording cannot be used.
    """
    profiles = list(dict.fromkeys(job.profile for job in jobs))
    recorded = score_recording(recording) if recording else None
    results = []
    for result in on_all_processors(run, jobs, ordered=False):
        results.append(result)
        done()
    return Evaluation(sorted(results, key=lambda r: (profiles.index(r.job.profile), r.job.seed)), recorded)


def ride_of(job: Job) -> SimulatedRide:
    upright_sign, pitch_sign = (1, -1)[job.seed % 2], (1, -1)[job.seed // 2 % 2]
    errors_deg = upright_sign * job.upright_error_deg, pitch_sign * job.pitch_change_deg
    return ride(job.profile, job.seed, job.seconds, *errors_deg)


def ridden(job: Job) -> tuple[SimulatedRide, dict[str, NDArray[np.float64]]]:
    """Simulate a ride, calibrate it, and run every estimator over it.

    The calibration uses one log of the six positions, and the two poses. Returns the ride and the lean of each
    estimator, by name, in degrees. Raises InputError if the poses are refused.
    """
    simulated = ride_of(job)
    calibration = calibrated_by_log(simulated)
    return simulated, estimators.estimate(as_log(simulated), calibration) | estimators.leans(simulated)


def run(job: Job) -> Result:
    try:
        simulated, leans = ridden(job)
    except InputError as error:
        return Result(job, refusal=str(error))
    return Result(job, {name: score(lean, simulated.truth, simulated.rate_hz) for name, lean in leans.items()})


def on_all_processors(function: Callable, jobs: list, chunk: int = 1, ordered: bool = True) -> Iterator:
    """Yield function(job) for each job, computed on all processors.

    ordered: True yields the results in the order of the jobs, False as soon as they are ready.
    """
    with multiprocessing.Pool(min(len(jobs), os.cpu_count() or 1), _begin_worker) as pool:
        yield from (pool.imap if ordered else pool.imap_unordered)(function, jobs, chunk)
        # Do not stop the workers with SIGTERM. A worker that receives SIGTERM before _begin_worker() would hang
        pool.close()
        pool.join()


def calibrated_by_poses(simulated: SimulatedRide) -> CalibrationFile:
    """Calibrate a ride like `kickstand calibrate six` and `two`, with one log per pose. Raises InputError."""
    seven = [Log.from_readings(pose, simulated.rate_hz, f"POSE_{k}.csv") for k, pose in enumerate(simulated.poses, 1)]
    return _aligned(simulated, fit_six_positions(seven).calibration)


def calibrated_by_log(simulated: SimulatedRide) -> CalibrationFile:
    """Calibrate a ride likewise, with one log of all six positions as on the board. Raises InputError."""
    six = Log.from_readings(simulated.procedure, simulated.rate_hz, "SIX.csv")
    return _aligned(simulated, fit_procedure(six).calibration)


def _aligned(simulated: SimulatedRide, six: CalibrationFile) -> CalibrationFile:
    kickstand = Log.from_readings(simulated.kickstand, simulated.rate_hz, "KICKSTAND.csv")
    upright = Log.from_readings(simulated.upright, simulated.rate_hz, "UPRIGHT.csv")
    return fit_two_positions(kickstand, upright, six).calibration


def as_log(simulated: SimulatedRide) -> Log:
    """Return the ride as the log that a reader of its file would return."""
    readings = simulated.readings
    return Log(simulated.time, readings[:, :3], readings[:, 4:], temperature_c=readings[:, 3], name="RIDE.csv")


def _begin_worker() -> None:
    """Prepare a worker process.

    Close standard error, because every worker would print a traceback after Ctrl-C. Restore the default handler of
    SIGTERM, which ends the worker at once. The command's handler, which the worker inherits, would wait for a lock.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    sys.stderr = open(os.devnull, "w", encoding="utf-8")
