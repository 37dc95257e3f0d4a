"""Tests whether the lean meter ever shows a wrong lean as good, in simulated rides with each fault.

The lean is judged as in aviation. At each moment the lean is good (shown and right), hidden, or misleading. A lean is
right if its error is at most WRONG_DEG. A wrong lean is misleading if it is shown for over STANDS_S.
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
TURN = 2  # number of readings per pass of the app's loop
GPS_LATE_S = 0.4
PROFILES = "street", "track", "hills", "city", "sweeper"
SIGMA_EDGES = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0])  # limits of the classes of claimed sigma, in degrees
# Classes of claimed accuracy. "display" is for the lean on the display of the whole device, which shows no sigma
CLAIMS = [f"{low:g}-{high:g}" for low, high in pairwise(SIGMA_EDGES)] + ["display", "hidden"]
# Limits of the classes of error, in degrees
ERROR_EDGES = np.array([0.0, 1.0, 2.0, 3.0, 5.0, WRONG_DEG, 12.0, 20.0, 40.0, 180.0])


@dataclass(frozen=True)
class FaultJob:
    """A ride to simulate, with or without a fault.

    fault: The fault, or None.
    seed: Seed of the ride and of the fault.
    seconds: Riding time.
    road: Class of the road, as for simulation.ride.ride().
    mount: Fault of the mount, as for simulation.ride.ride().
    profile: Profile of the ride. None lets the seed choose it from PROFILES.
    device: True to run the whole device, False to run only the lean meter.
    """

    fault: Fault | None
    seed: int
    seconds: float = 120.0
    road: str | None = None
    mount: str | None = None
    profile: str | None = None
    device: bool = False

    @property
    def gps(self) -> bool:
        """True for every fourth ride. A ride with a GPS has a late speed once per second."""
        return self.seed % 4 == 3

    @property
    def title(self) -> str:
        if self.fault:
            return self.fault.title
        return "none" + (f", {self.mount}" if self.mount else "") + (f", road {self.road}" if self.road else "")


@dataclass
class Trace:
    """The display during a ride, and the truth. The arrays have one entry per pass of the loop, shape (n).

    time: Time in s.
    lean: Lean of the meter, in degrees.
    sigma: Standard deviation that the meter claims, in degrees.
    shown: True if the lean is shown.
    true: True lean, in degrees.
    speed: True speed, in m/s.
    named_s: Time at which the display named a fault, or NaN.
    first_s: Start of the fault.
    end_s: End of the fault.
    """

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
    """The result of a ride. Only the time after the bike set off counts.

    job: The ride.
    misleading_s: Time with a misleading lean.
    longest_s: Longest single stretch with a misleading lean.
    available: Share of the riding time in which a lean is shown.
    hidden_after_s: Time from the start of the fault until the lean is hidden. NaN if it is never hidden.
    named_after_s: Time from the start of the fault until the display names the fault. NaN if it never does.
    recovered: True if the lean is right RECOVERY_S after the fault ends. None for a fault that does not end.
    diagram: Seconds in each class of CLAIMS and each class of ERROR_EDGES, shape (len(CLAIMS), len(ERROR_EDGES) - 1).
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
    """Find the runs of True in the mask. Returns, for each run, the index of its first entry and the index after its
    last entry."""
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
    except InputError:  # calibrate without the slanted pose, which refuses sensors with large cross-axis errors
        return made, calibrated_by_poses(replace(made, poses=made.poses[:6]))


def follow(job: FaultJob) -> Trace:
    """Simulate the job's ride, and return what the rider saw."""
    made, calibration = _made(
        job.profile or PROFILES[job.seed % len(PROFILES)], job.seed, job.seconds, job.road, job.mount
    )
    of = device_trace_of if job.device else trace_of
    return of(job, made.readings, made.rate_hz, calibration, made.truth["lean_deg"], made.truth["speed_mps"])


def _ill(job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile) -> Ill:
    """Return the readings with the job's fault."""
    if not job.fault:
        return Ill(readings, np.zeros(len(readings), dtype=bool), 0, len(readings))
    begin_s = (0.35 + 0.2 * (job.seed * 0.618 % 1.0)) * len(readings) / rate_hz
    return apply(job.fault, readings, rate_hz, begin_s, job.seed, calibration.vehicle_from_sensor)


def device_trace_of(
    job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile, true: Array, speed: Array
) -> Trace:
    """Run the whole device over any ride. The arguments are the same as for trace_of().

    The Trace has ten entries per second. Its sigma is NaN, because the display shows no sigma.
    """
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
    """Run only the firmware's lean meter, without the driver, over any ride.

    job: The fault, and whether the ride has a speed.
    readings: Readings in the chip's order, shape (n, 7).
    rate_hz: Number of readings per second.
    calibration: Calibration of the sensor.
    true: True lean, shape (n), in degrees.
    speed: True speed, shape (n), in m/s.
    """
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
    """Simulate the job's ride, and judge the lean that the rider saw."""
    return judge(job, follow(job))


def jobs(seeds: int, first_seed: int = 0, seconds: float = 120.0, device: bool = False) -> list[FaultJob]:
    """Return the jobs for each seed: rides without a fault on good and bad mounts and roads, and one ride per fault.

    device: True runs all rides on the whole device. False runs only rides with a fault of the kind SEEN on the whole
    device, and all other rides on the lean meter alone.
    """
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
    """Run all jobs on all processors. Returns the outcomes in the order of the jobs.

    done: function that is called after each job.
    """

    def ride_of(k: int) -> tuple[int | str, ...]:
        job = jobs[k]
        return (job.seed, str(job.profile), str(job.road), str(job.mount))

    order = sorted(range(len(jobs)), key=ride_of)  # jobs with the same ride are adjacent, so _made() can reuse the ride
    found: dict[int, Outcome] = {}
    for k, outcome in zip(order, on_all_processors(run, [jobs[k] for k in order], chunk=8), strict=True):
        found[k] = outcome
        done()
    return [found[k] for k in range(len(jobs))]
