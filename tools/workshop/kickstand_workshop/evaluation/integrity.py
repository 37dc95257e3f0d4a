"""Tests whether the lean meter ever shows a wrong lean as good, in simulated rides with each fault.

The lean is judged as in aviation. At each moment the lean is good (shown and right), hidden, or misleading. A lean is
right if its error is at most WRONG_DEG. A wrong lean is misleading if it is shown for over STANDS_S.
summaries(), fault_table() and document() report the results for each fault.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import Any

import numpy as np
from kickstand.lean.meter import FALLEN_DEG
from kickstand_sim.simulation.physics.chip import MOUNTS
from kickstand_sim.simulation.physics.road import CLASSES
from kickstand_sim.simulation.ride import SimulatedRide, ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.messages import InputError
from kickstand_tools.replay.replay_engine import NO_SPEED, Replay
from kickstand_tools.signals import intervals
from numpy.typing import NDArray
from rich import box
from rich.table import Table

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
CAPTION = (
    f"misleading: seconds per ride in which an error over {WRONG_DEG:.0f} degrees was shown for over {STANDS_S:.0f} s, "
    "mean and largest; shown: share of the riding time with a lean; hidden, named: median of the seconds from the "
    "start of the fault, and share of the rides; right again: share of the rides whose lean is right 10 s after the "
    "end of the fault"
)


@dataclass(frozen=True)
class FaultJob:
    fault: Fault | None  # the fault, or None
    seed: int  # seed of the ride and of the fault
    seconds: float = 120.0  # riding time
    road: str | None = None  # class of the road, as for simulation.ride.ride()
    mount: str | None = None  # fault of the mount, as for simulation.ride.ride()
    profile: str | None = None  # profile of the ride. None lets the seed choose it from PROFILES.
    device: bool = False  # True to run the whole device, False to run only the lean meter

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
    """The display during a ride, and the truth. The arrays have one entry per pass of the loop, shape (n)."""

    time: Array  # time in s
    lean: Array  # lean of the meter, in degrees
    shown: NDArray[np.bool_]  # True if the lean is shown
    true: Array  # True lean, in degrees
    speed: Array  # True speed, in m/s
    named_s: float  # time at which the display named a fault, or NaN
    first_s: float  # start of the fault
    end_s: float  # end of the fault


@dataclass
class Outcome:
    """The result of a ride. Only the time after the bike set off counts."""

    job: FaultJob  # the ride
    misleading_s: float  # time with a misleading lean
    longest_s: float  # longest single stretch with a misleading lean
    available: float  # share of the riding time in which a lean is shown
    hidden_after_s: float  # time from the start of the fault until the lean is hidden. NaN if it is never hidden.
    named_after_s: float  # time from the start of the fault until the display names the fault. NaN if it never does.
    # True if the lean is right RECOVERY_S after the fault ends. None for a fault that does not end.
    recovered: bool | None


def judge(job: FaultJob, trace: Trace) -> Outcome:
    """Judge the lean of a ride. The time before the bike sets off does not count."""
    step = float(np.median(np.diff(trace.time)))
    off = int(np.argmax(trace.speed > 0.5)) if (trace.speed > 0.5).any() else 0
    error = np.abs(trace.lean - trace.true)
    wrong = trace.shown & (error > WRONG_DEG)
    wrong[:off] = False
    times = [(end - first) * step for first, end in intervals(wrong) if (end - first) * step > STANDS_S]
    riding = trace.speed > 0.5
    faulty = trace.time >= max(trace.first_s, trace.time[off])
    recovered = None
    if trace.end_s < trace.time[-1] - RECOVERY_S:
        checked = (trace.time > trace.end_s + RECOVERY_S - STANDS_S) & (trace.time <= trace.end_s + RECOVERY_S)
        recovered = bool(np.all(trace.shown[checked] & (error[checked] <= WRONG_DEG)))
    return Outcome(
        job=job,
        misleading_s=sum(times),
        longest_s=max(times, default=0.0),
        available=float(np.mean(trace.shown[riding])) if riding.any() else 1.0,
        hidden_after_s=_first(trace.time, faulty & ~trace.shown) - trace.first_s,
        named_after_s=trace.named_s - trace.first_s,
        recovered=recovered,
    )


def _first(time: Array, mask: NDArray[np.bool_]) -> float:
    return float(time[np.argmax(mask)]) if mask.any() else float("nan")


@lru_cache(maxsize=4)
def _simulated(
    profile: str, seed: int, seconds: float, road: str | None, mount: str | None
) -> tuple[SimulatedRide, CalibrationFile]:
    simulated = ride(profile, seed, seconds, road=road, mount=mount)
    try:
        return simulated, calibrated_by_poses(simulated)
    except InputError:  # calibrate without the slanted pose, which refuses sensors with large cross-axis errors
        return simulated, calibrated_by_poses(replace(simulated, poses=simulated.poses[:6]))


def follow(job: FaultJob) -> Trace:
    profile = job.profile or PROFILES[job.seed % len(PROFILES)]
    simulated, calibration = _simulated(profile, job.seed, job.seconds, job.road, job.mount)
    true, speed = simulated.truth["lean_deg"], simulated.truth["speed_mps"]
    run_ride = device_trace_of if job.device else trace_of
    return run_ride(job, simulated.readings, simulated.rate_hz, calibration, true, speed)


def _ill(job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile) -> Ill:
    if not job.fault:
        return Ill(readings, np.zeros(len(readings), dtype=bool), 0, len(readings))
    begin_s = (0.35 + 0.2 * (job.seed * 0.618 % 1.0)) * len(readings) / rate_hz
    return apply(job.fault, readings, rate_hz, begin_s, job.seed, calibration.vehicle_from_sensor)


def device_trace_of(
    job: FaultJob, readings: Array, rate_hz: float, calibration: CalibrationFile, true: Array, speed: Array
) -> Trace:
    """Run the whole device over any ride, like trace_of(). The Trace has ten entries per second."""
    ill = _ill(job, readings, rate_hz, calibration)
    end = len(readings) - 1

    def speed_at(t_s: float) -> float:
        return float(speed[min(end, int(t_s * rate_hz))])

    time, lean, named_s = display_of(ill.readings, rate_hz, calibration, ill.lost, speed_at if job.gps else None)
    index = np.minimum(end, (time * rate_hz).astype(int))
    shown = ~np.isnan(lean)
    lean = np.where(shown, lean, true[index])
    return Trace(time, lean, shown, true[index], speed[index], named_s, ill.first / rate_hz, ill.end / rate_hz)


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
    lean, shown = np.zeros(turns), np.zeros(turns, dtype=bool)
    named_s = float("nan")
    meter = replay.meter
    previous = None
    step_us = round(1e6 * TURN / rate_hz)
    for k in range(turns):
        if job.gps and k % round(rate_hz / TURN) == 0:
            meter.measure_speed(float(speed[max(0, int(last[k]) - late)]) if k else NO_SPEED)
        if lost[k]:
            lean[k] = lean[k - 1]
            continue
        meter.update_in_vehicle(force[k], rate[k], 0 if previous is None else (k - previous) * step_us)
        previous = k
        lean[k] = meter.lean_deg
        shown[k] = meter.trusted and not meter.fallen and abs(meter.lean_deg) <= FALLEN_DEG
        if np.isnan(named_s) and meter.odd:
            named_s = k * TURN / rate_hz
    time = last / rate_hz
    return Trace(time, lean, shown, true[last], speed[last], named_s, first / rate_hz, end / rate_hz)


def run(job: FaultJob) -> Outcome:
    return judge(job, follow(job))


def jobs(seeds: int, first_seed: int = 0, seconds: float = 120.0, device: bool = True) -> list[FaultJob]:
    """Return the jobs for each seed: rides without a fault on good and bad mounts and roads, and one ride per fault.

    device: False runs the lean meter alone, except in rides with a fault of the kind SEEN.
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

    order = sorted(range(len(jobs)), key=ride_of)  # jobs with the same ride are adjacent, for the cache of _simulated()
    outcomes: dict[int, Outcome] = {}
    for k, outcome in zip(order, on_all_processors(run, [jobs[k] for k in order], chunk=8), strict=True):
        outcomes[k] = outcome
        done()
    return [outcomes[k] for k in range(len(jobs))]


def summaries(outcomes: list[Outcome]) -> list[dict[str, Any]]:
    """Summarise the rides with each fault, in the order in which the faults first appear.

    Returns one dictionary per fault. Shares are of the rides, and NaN means that no ride determines a figure:

    kind, title, rides: Kind of the fault or "none", its name, and the number of rides.
    misleading_s, most_s: Mean and largest time with a misleading lean.
    available: Mean share of the riding time in which a lean is shown.
    hidden_s, hidden: Median time from the start of the fault until the lean is hidden, and the share.
    named_s, named: Likewise until the display names the fault.
    recovered: Share in which the lean is right after a fault that ends.
    """
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in outcomes:
        fault = outcome.job.fault
        groups.setdefault((fault.kind if fault else "none", outcome.job.title), []).append(outcome)
    rows = []
    for (kind, title), rides in groups.items():
        misleading = [o.misleading_s for o in rides]
        recovered = [o.recovered for o in rides if o.recovered is not None]
        hidden_s, hidden = _median_and_share([o.hidden_after_s for o in rides])
        named_s, named = _median_and_share([o.named_after_s for o in rides])
        rows.append(
            {
                "kind": kind,
                "title": title,
                "rides": len(rides),
                "misleading_s": float(np.mean(misleading)),
                "most_s": max(misleading),
                "available": float(np.mean([o.available for o in rides])),
                "hidden_s": hidden_s,
                "hidden": hidden,
                "named_s": named_s,
                "named": named,
                "recovered": float(np.mean(recovered)) if recovered else float("nan"),
            }
        )
    return rows


def _median_and_share(values: list[float]) -> tuple[float, float]:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.median(finite)) if finite else float("nan"), len(finite) / len(values)


# Head, key in summaries() and format of each column
_COLUMNS = (
    ("mis-\nleading", "misleading_s", "{:.1f}"),
    ("most", "most_s", "{:.1f}"),
    ("shown", "available", "{:.1%}"),
    ("hidden\nafter", "hidden_s", "{:.1f}"),
    ("of\nrides", "hidden", "{:.0%}"),
    ("named\nafter", "named_s", "{:.1f}"),
    ("of\nrides", "named", "{:.0%}"),
    ("right\nagain", "recovered", "{:.0%}"),
)


def fault_table(outcomes: list[Outcome]) -> Table:
    """Return a table with one line per fault, and one block of lines per kind of fault."""
    table = Table(title="Rides with a fault of the sensor", caption=CAPTION, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("fault", overflow="fold")
    for head, _, _ in _COLUMNS:
        table.add_column(head, justify="right")
    for kind, rows in groupby(summaries(outcomes), lambda row: row["kind"]):
        table.add_row(kind, style="cyan")
        for row in rows:
            values = [(row[name], form) for _, name, form in _COLUMNS]
            cells = ("--" if np.isnan(value) else form.format(value).replace("%", " %") for value, form in values)
            table.add_row("  " + row["title"], *cells)
    return table


def document(outcomes: list[Outcome]) -> dict[str, Any]:
    """Return all figures for JSON. A figure that is NaN becomes null."""
    rides = [{"fault": o.job.title, "seed": o.job.seed, **vars(o)} for o in outcomes]
    for entry in rides:
        del entry["job"]
    data = {"faults": summaries(outcomes), "rides": rides}
    return json.loads(json.dumps(data), parse_constant=lambda _: None)
