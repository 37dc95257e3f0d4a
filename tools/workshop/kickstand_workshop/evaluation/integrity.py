"""Tests whether the meter ever shows a wrong lean as good. It runs the firmware's meter over simulated rides with each
fault.

The result is judged as in aviation: at each instant a lean is good (shown and right), hidden, or misleading. A lean is
right if its error is at most WRONG_DEG. A wrong lean counts as misleading after it was shown for STANDS_S.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
from kickstand.lean.meter import FALLEN_DEG
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError
from kickstand_tools.replay.replay_engine import NO_SPEED, Replay
from kickstand_tools.simulation.physics.mount import MOUNTS
from kickstand_tools.simulation.physics.road import CLASSES
from kickstand_tools.simulation.ride import SimulatedRide, ride
from numpy.typing import NDArray

from .faults import FAULTS, SEEN, Fault, Ill, apply
from .runs import calibrated_by_poses, on_all_processors
from .whole_device import display_of

Array = NDArray[np.float64]

WRONG_DEG = 8.0
STANDS_S = 1.0
RECOVERY_S = 10.0
TURN = 2  # readings per turn of the loop
GPS_LATE_S = 0.4
PROFILES = "street", "track", "hills", "city", "sweeper"
SIGMA_EDGES = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0])  # degrees, claimed
# Classes of claimed accuracy. "display" is the class of a displayed lean, which has no sigma
CLAIMS = [f"{low:g}-{high:g}" for low, high in pairwise(SIGMA_EDGES)] + ["display", "hidden"]
ERROR_EDGES = np.array([0.0, 1.0, 2.0, 3.0, 5.0, WRONG_DEG, 12.0, 20.0, 40.0, 180.0])  # degrees


@dataclass(frozen=True)
class FaultJob:
    """A ride with a fault, or without one. road, mount: as for simulation.ride.ride(). profile: None if the seed
    chooses it from PROFILES. device: True to run the whole device, False for only the meter."""

    fault: Fault | None
    seed: int
    seconds: float = 120.0
    road: str | None = None
    mount: str | None = None
    profile: str | None = None
    device: bool = False

    @property
    def gps(self) -> bool:
        """True for every fourth ride. Its speed comes late and once per second, as from GPS."""
        return self.seed % 4 == 3

    @property
    def title(self) -> str:
        if self.fault:
            return self.fault.title
        return "none" + (f", {self.mount}" if self.mount else "") + (f", road {self.road}" if self.road else "")


@dataclass
class Trace:
    """A ride as shown, one entry per turn of the loop (n): time (s), lean and sigma (degrees), shown, true lean
    (degrees), speed (m/s). named_s: time at which a fault was named, or NaN. first_s, end_s: start and end of the
    fault."""

    time: Array
    lean: Array
    sigma: Array
    shown: NDArray[np.bool_]
    true: Array
    speed: Array
    named_s: float
    first_s: float
    end_s: float


@dataclass
class Outcome:
    """The result of a ride. Only the time from setting off counts.

    misleading_s: time with a misleading lean. hidden, available: shares of the riding time. hidden_after_s,
    named_after_s: since the fault's start, NaN for never. recovered: True if the lean is right RECOVERY_S after the
    fault ends, None for a fault that does not end. diagram: seconds (len(CLAIMS), len(ERROR_EDGES) - 1) for each claim
    and error.
    """

    job: FaultJob
    misleading_s: float
    longest_s: float
    available: float
    hidden_after_s: float
    named_after_s: float
    recovered: bool | None
    diagram: Array


def stretches(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first, end) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def judge(job: FaultJob, trace: Trace) -> Outcome:
    """Judge the lean that the rider saw in a ride."""
    step = float(np.median(np.diff(trace.time)))
    off = int(np.argmax(trace.speed > 0.5)) if (trace.speed > 0.5).any() else 0
    error = np.abs(trace.lean - trace.true)
    wrong = trace.shown & (error > WRONG_DEG)
    wrong[:off] = False
    times = [(end - first) * step for first, end in stretches(wrong) if (end - first) * step > STANDS_S]
    riding = trace.speed > 0.5
    there = trace.time >= max(trace.first_s, trace.time[off])
    hidden_s = _first(trace.time, there & ~trace.shown) - trace.first_s
    recovered = None
    if trace.end_s < trace.time[-1] - RECOVERY_S:
        stands = (trace.time > trace.end_s + RECOVERY_S - STANDS_S) & (trace.time <= trace.end_s + RECOVERY_S)
        recovered = bool(np.all(trace.shown[stands] & (error[stands] <= WRONG_DEG)))
    row = np.digitize(trace.sigma, SIGMA_EDGES[1:-1])
    row[np.isnan(trace.sigma)] = len(CLAIMS) - 2
    row[~trace.shown] = len(CLAIMS) - 1
    column = np.digitize(error, ERROR_EDGES[1:-1])
    diagram = np.zeros((len(CLAIMS), len(ERROR_EDGES) - 1))
    np.add.at(diagram, (row[riding], column[riding]), step)
    return Outcome(
        job,
        sum(times),
        max(times, default=0.0),
        float(np.mean(trace.shown[riding])) if riding.any() else 1.0,
        hidden_s,
        trace.named_s - trace.first_s,
        recovered,
        diagram,
    )


def _first(time: Array, mask: NDArray[np.bool_]) -> float:
    return float(time[np.argmax(mask)]) if mask.any() else float("nan")


@lru_cache(maxsize=4)
def _made(
    profile: str, seed: int, seconds: float, road: str | None, mount: str | None
) -> tuple[SimulatedRide, CalibrationFile]:
    made = ride(profile, seed, seconds, road=road, mount=mount)
    try:
        return made, calibrated_by_poses(made)
    except InputError:  # some sensors' cross-axis errors exceed the limit for the slanted pose
        return made, calibrated_by_poses(replace(made, poses=made.poses[:6]))


def follow(job: FaultJob) -> Trace:
    """Simulate the job's ride and return it as shown."""
    made, calibration = _made(
        job.profile or PROFILES[job.seed % len(PROFILES)], job.seed, job.seconds, job.road, job.mount
    )
    of = device_trace_of if job.device else trace_of
    return of(job, made.readings, made.rate_hz, calibration, made.truth["lean_deg"], made.truth["speed_mps"])


def _ill(job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile) -> Ill:
    """The readings with the job's fault."""
    if not job.fault:
        return Ill(readings, np.zeros(len(readings), dtype=bool), 0, len(readings))
    begin_s = (0.35 + 0.2 * (job.seed * 0.618 % 1.0)) * len(readings) / rate_hz
    return apply(job.fault, readings, rate_hz, begin_s, job.seed, calibration.vehicle_from_sensor)


def device_trace_of(
    job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile, true: Array, speed: Array
) -> Trace:
    """trace_of() for the whole device, one entry per tenth of a second; sigma is NaN."""
    ill = _ill(job, readings, rate_hz, calibration)
    end = len(readings) - 1

    def known(t_s: float) -> float:
        return float(speed[min(end, int(t_s * rate_hz))])

    time, lean, named_s = display_of(ill.readings, rate_hz, calibration, ill.lost, known if job.gps else None)
    at = np.minimum(end, (time * rate_hz).astype(int))
    shown = ~np.isnan(lean)
    nothing = np.full(len(time), np.nan)
    lean = np.where(shown, lean, true[at])
    return Trace(time, lean, nothing, shown, true[at], speed[at], named_s, ill.first / rate_hz, ill.end / rate_hz)


def trace_of(
    job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile, true: Array, speed: Array
) -> Trace:
    """Run only the firmware's meter, without the driver, over any ride: readings (n, 7) in the chip's order, true lean
    (n, degrees) and speed (n, m/s)."""
    ill = _ill(job, readings, rate_hz, calibration)
    readings, lost, first, end = ill.readings, ill.lost | ill.saturated, ill.first, ill.end
    force, rate = calibration.in_vehicle(readings)
    turns = len(readings) // TURN
    shape = (turns, TURN, 3)
    force = force[: turns * TURN].reshape(shape).mean(axis=1).tolist()
    rate = np.radians(rate[: turns * TURN]).reshape(shape).mean(axis=1).tolist()
    lost = np.any(lost[: turns * TURN].reshape(turns, TURN), axis=1).tolist()
    last = np.arange(1, turns + 1) * TURN - 1
    late = round(GPS_LATE_S * rate_hz)
    replay = Replay(calibration.to_firmware(), delay_s=calibration.delay_s())
    lean, sigma, shown = np.zeros(turns), np.full(turns, 180.0), np.zeros(turns, dtype=bool)
    named_s = float("nan")
    meter = replay.meter
    before = None
    step_us = round(1e6 * TURN / rate_hz)
    for k in range(turns):
        if job.gps and k % round(rate_hz / TURN) == 0:
            meter.measure_speed(float(speed[max(0, int(last[k]) - late)]) if k else NO_SPEED)
        if lost[k]:
            lean[k], sigma[k], shown[k] = lean[k - 1], sigma[k - 1], False
            continue
        meter.update_in_vehicle(force[k], rate[k], 0 if before is None else (k - before) * step_us)
        before = k
        lean[k] = meter.lean_deg
        sigma[k] = np.degrees(np.sqrt(max(0.0, meter.filter.variance)))
        shown[k] = meter.trusted and not meter.fallen and abs(meter.lean_deg) <= FALLEN_DEG
        if named_s != named_s and meter.odd:
            named_s = k * TURN / rate_hz
    time = last / rate_hz
    return Trace(time, lean, sigma, shown, true[last], speed[last], named_s, first / rate_hz, end / rate_hz)


def run(job: FaultJob) -> Outcome:
    """follow() and judge()."""
    return judge(job, follow(job))


def jobs(seeds: int, first_seed: int = 0, seconds: float = 120.0, device: bool = False) -> list[FaultJob]:
    """Return the jobs: for each seed, rides without a fault on good and bad mounts and roads, and one ride with each
    fault. device: True to run all on the whole device. Otherwise only rides with a fault that the driver sees run on
    it."""
    numbers = range(first_seed, first_seed + seeds)
    conditions: list[tuple[str | None, str | None]] = [(None, None), *[(None, road) for road in CLASSES]]
    conditions += [(mount, None) for mount in MOUNTS]
    sound = [
        FaultJob(None, seed, seconds, road, mount, device=device) for mount, road in conditions for seed in numbers
    ]
    return sound + [
        FaultJob(fault, seed, seconds, device=device or fault.kind == SEEN) for fault in FAULTS for seed in numbers
    ]


def evaluate(jobs: list[FaultJob], done: Callable[[], None] = lambda: None) -> list[Outcome]:
    """run() for each job, on all processors, in the order of the jobs. done(): called after each."""

    def ride_of(k: int) -> tuple[int | str, ...]:
        job = jobs[k]
        return (job.seed, str(job.profile), str(job.road), str(job.mount))

    order = sorted(range(len(jobs)), key=ride_of)  # jobs of the same ride are adjacent, so the ride is simulated once
    found: dict[int, Outcome] = {}
    for k, outcome in zip(order, on_all_processors(run, [jobs[k] for k in order], chunk=8), strict=True):
        found[k] = outcome
        done()
    return [found[k] for k in range(len(jobs))]
