"""Measures the lean in the first seconds after setting off, before the sensor's errors are found.

Each bike has two rides, between which its mount and its sensor stay the same. The first ride follows the poses of the
calibration. The next ride is on another road and at another temperature. It begins with what the firmware has stored
at the end of the first ride. Half of the bikes have done the six positions. The rider held the bike up to 3 degrees
from upright in the upright pose.
"""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from kickstand_sim.simulation import hands
from kickstand_sim.simulation.ride import ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.poses import fit_two_positions
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs.log import Log
from kickstand_tools.replay.replay_engine import Replay, ReplayMeter
from kickstand_tools.signals import intervals
from numpy.typing import NDArray
from rich import box
from rich.table import Table

from .drawn_rides import drawn_ride
from .integrity import PROFILES, TURN
from .runs import calibrated_by_log, on_all_processors, rms

Array = NDArray[np.float64]

FIRST_S = 40.0
RATE_HZ = 200.0
HELD_DEG = 0.0, 1.0, 2.0, 3.0
START_C = 22.0, 2.0, 32.0  # temperatures at the start of the next ride; the first ride starts at 22 degrees
_RIDE_S, _NEXT_S = 150.0, 110.0
_NEXT_SEED = 100_000  # difference between the seeds of a bike's rides
_STOP_S = 120.0  # time of the drawn ride after which the bike stops. There the ride is divided into two rides
_STAND_S = 10.0  # the next part begins this long before the bike sets off
ACCEL_PER_C, GYRO_PER_C = 0.0003, 0.06  # largest drift of an ordinary sensor, in g and deg/s per degree Celsius
CAPTION = (
    f"rms: error of the lean in the first {FIRST_S:.0f} s after setting off, and later, in degrees, over all rides; "
    f"shown: share of the first {FIRST_S:.0f} s with a lean"
)


@dataclass(frozen=True)
class BikeJob:
    simulator: str  # "physics" (kickstand_sim.simulation) or "drawn" (drawn_rides.py)
    profile: str  # a profile of PROFILES
    seed: int

    @property
    def six(self) -> bool:
        """True if the sensor was calibrated by the six positions, and not only by the two poses on the bike."""
        return self.seed // 8 % 2 == 0

    @property
    def held_deg(self) -> float:
        """Lean in the upright pose. A drawn ride has its own."""
        return HELD_DEG[self.seed // 2 % 4] * (1 if self.seed // 16 % 2 else -1)

    @property
    def start_c(self) -> float:
        return START_C[self.seed % 3]


@dataclass
class Part:
    """The errors of the lean in a ride."""

    first_deg: float  # rms in the first FIRST_S after setting off
    later_deg: float  # rms after this time
    shown: float  # share of the first FIRST_S in which the lean is shown


@dataclass
class Motion:
    """Readings in the chip's order, shape (n, 7), true lean in degrees and speed in m/s, shape (n)."""

    readings: Array
    lean: Array
    speed: Array


def jobs(seeds: int, first_seed: int = 0) -> list[BikeJob]:
    numbers = range(first_seed, first_seed + seeds)
    return [BikeJob(name, profile, k) for name in SIMULATORS for profile in PROFILES for k in numbers]


def run(job: BikeJob) -> tuple[Part, Part]:
    """Return the errors in a bike's first ride and in its next ride."""
    first, following, calibration = SIMULATORS[job.simulator](job)
    of_first, meter = judge(first, Replay(calibration.to_firmware(), calibration.delay_s()))
    meter.keep_trim()
    return of_first, judge(following, Replay(meter.calibration, calibration.delay_s()))[0]


def physics(job: BikeJob) -> tuple[Motion, Motion, CalibrationFile]:
    """Return the bike's rides in kickstand_sim.simulation, and the calibration before the first ride."""
    first = ride(job.profile, job.seed, _RIDE_S, job.held_deg)
    chance, temp_c = np.random.default_rng([job.seed, 52]), float(first.readings[-1, 3])
    still = [hands.standing(chance, first.chip, first.vehicle_from_sensor, 0.0, 0.5, temp_c, True) for _ in range(3)]
    n = sum(len(readings) for readings in still)
    kickstand, upright = (Log.from_readings(pose, RATE_HZ) for pose in (first.kickstand, first.upright))
    calibration = fit_two_positions(kickstand, upright).calibration
    if job.six:
        with suppress(InputError):  # the six positions refuse a few sensors
            calibration = calibrated_by_log(first)
    following = ride(job.profile, job.seed + _NEXT_SEED, _NEXT_S, earlier=first, start_c=job.start_c)
    a, b = (Motion(r.readings, r.truth["lean_deg"], r.truth["speed_mps"]) for r in (first, following))
    a = Motion(np.concatenate((a.readings, *still)), np.pad(a.lean, (0, n)), np.pad(a.speed, (0, n)))
    return a, b, calibration


def drawn(job: BikeJob) -> tuple[Motion, Motion, CalibrationFile]:
    """Return the two halves of a drawn ride like physics(). The sensor's temperature changes between the halves."""
    kind, seconds = ("sweepers", 330.0) if job.profile == "sweeper" else (job.profile, 260.0)
    drawn = drawn_ride(job.seed, seconds, ["firm"], kind, sheet=True, six=job.six, stop_s=_STOP_S)
    readings, lean = drawn.logs[0].readings, drawn.true_lean(0)
    speed = np.interp(drawn.logs[0].t_s, drawn.time_s, drawn.speed_mps)
    stops = [(begin, end) for begin, end in intervals(speed < 0.3) if begin > 0.5 * _STOP_S * RATE_HZ]
    _, end_of_longest = max(stops, key=lambda stop: stop[1] - stop[0])
    cut = end_of_longest - round(_STAND_S * RATE_HZ)
    chance = np.random.default_rng([job.seed, 52])
    drift = np.concatenate((ACCEL_PER_C * chance.uniform(-1, 1, 3), [1.0], GYRO_PER_C * chance.uniform(-1, 1, 3)))
    first = Motion(readings[:cut], lean[:cut], speed[:cut])
    following = Motion(readings[cut:] + (job.start_c - START_C[0]) * drift, lean[cut:], speed[cut:])
    return first, following, drawn.calibrations[0]


SIMULATORS = {"physics": physics, "drawn": drawn}


def judge(motion: Motion, replay: Replay) -> tuple[Part, ReplayMeter]:
    """Run the meter over a ride. Return the errors of its lean, and the meter at the end."""
    meter, n = replay.meter, len(motion.readings) // TURN
    means = motion.readings[: n * TURN].reshape(n, TURN, 7).mean(axis=1)
    force, rate = meter.in_vehicle(means.T)
    step_us = round(1e6 * TURN / RATE_HZ)
    samples = zip(range(0, n * step_us, step_us), np.transpose(force).tolist(), np.transpose(rate).tolist(), [-1.0] * n)
    shown, error = np.zeros(n, dtype=bool), np.zeros(n)
    for k, _ in enumerate(replay.follow(samples)):
        error[k] = meter.lean_deg - motion.lean[k * TURN + TURN - 1]
        shown[k] = meter.trusted and not meter.fallen
    off = int(np.argmax(motion.speed > 0.5)) // TURN
    end = off + round(FIRST_S * RATE_HZ / TURN)
    return Part(rms(error[off:end]), rms(error[end:]), float(shown[off:end].mean())), meter


def evaluate(jobs: list[BikeJob], done: Callable[[], None] = lambda: None) -> list[tuple[BikeJob, Part, Part]]:
    """Run all jobs on all processors. done: function that is called after each job."""
    results = []
    for job, parts in zip(jobs, on_all_processors(run, jobs), strict=True):
        results.append((job, *parts))
        done()
    return results


def summaries(results: list[tuple[BikeJob, Part, Part]]) -> list[dict[str, Any]]:
    """Return the figures over all bikes of each simulator and profile."""
    rows = []
    for simulator, profile in dict.fromkeys((job.simulator, job.profile) for job, *_ in results):
        bikes = [parts for job, *parts in results if (job.simulator, job.profile) == (simulator, profile)]
        row: dict[str, Any] = {"simulator": simulator, "profile": profile, "bikes": len(bikes)}
        for k, name in enumerate(("first_ride", "next_ride")):
            parts = [bike[k] for bike in bikes]
            rms = {of: np.sqrt(np.mean([getattr(p, of) ** 2 for p in parts])) for of in ("first_deg", "later_deg")}
            row[name] = {of: float(value) for of, value in rms.items()}
            row[name]["shown"] = float(np.mean([part.shown for part in parts]))
        rows.append(row)
    return rows


def table(results: list[tuple[BikeJob, Part, Part]]) -> Table:
    """Return a table with one line per simulator and profile."""
    report = Table(title="The first seconds after setting off", caption=CAPTION, box=box.SIMPLE_HEAD)
    report.add_column("rides")
    for name in "first ride", "next ride":
        for head in f"{name}\nrms", "\nlater", "\nshown":
            report.add_column(head, justify="right")
    for row in summaries(results):
        cells = []
        for name in "first_ride", "next_ride":
            cells += [f"{row[name][of]:.2f}" for of in ("first_deg", "later_deg")]
            cells.append(f"{100.0 * row[name]['shown']:.1f} %")
        report.add_row(f"{row['simulator']}, {row['profile']}", *cells)
    return report


def document(results: list[tuple[BikeJob, Part, Part]]) -> dict[str, Any]:
    """Return all figures for JSON."""
    rides = [{**vars(job), "first_ride": vars(a), "next_ride": vars(b)} for job, a, b in results]
    return json.loads(json.dumps({"first_seconds": summaries(results), "rides": rides}))
