"""Measures the error of the lean in rides of both simulators, to compare it with its targets.

Each sensor has all errors of the data sheet and is calibrated by one log of the six positions. The upright pose is 1.5
degrees off. The dive of each bike is random. Rides are judged with and without a measured speed. Parameters are fitted
with even seeds only, and figures are reported for odd seeds.

The program prints one line per simulator, profile and mount. The program takes 20 s per ride on one processor:

    OMP_NUM_THREADS=1 PYTHONPATH=host_tests .venv/bin/python -m support.recordings.limit_rides odd 4
"""

import sys
from dataclasses import dataclass, replace

import numpy as np
from kickstand_tools.api import replay, smooth
from kickstand_tools.simulation.physics.mount import MOUNTS as SIMULATED_MOUNTS
from kickstand_tools.simulation.ride import ride
from kickstand_workshop.evaluation.runs import as_log, calibrated_by_log

from support.recordings.drawn_rides import MOUNTS as DRAWN_MOUNTS, drawn_ride
from support.recordings.smoothed_rides import Known, rms

# Largest rms error of the live lean for each profile, in degrees
TARGETS = {"street": 0.35, "track": 0.50, "sweeper": 0.38, "city": 0.28, "hills": 0.34}
SECONDS = 240.0
SPEEDS = ("GPS 1 Hz", "GPS 10 Hz", "wheel")


@dataclass
class Measured(Known):
    """A ride with its true speed, shape (n), in m/s."""

    speed_mps: np.ndarray

    def with_speed(self, kind, seed):
        """Return the log with the speed as a GPS receiver or a contact at the rear wheel measures it.

        kind: one of SPEEDS.
        """
        chance, time = np.random.default_rng([seed, *kind.encode()]), self.log.t_s
        hz, late = {"GPS 1 Hz": (1.0, 0.5), "GPS 10 Hz": (10.0, 0.2), "wheel": (4.0, 0.0)}[kind]
        at = np.arange(time[0] + 1.0, time[-1], 1.0 / hz)
        n = len(at)
        true, lean = (np.interp(at - late, time, values) for values in (self.speed_mps, self.lean_deg))
        if kind == "wheel":
            # Three errors of a wheel's speed: the tyre is worn, its rolling radius is smaller when the bike leans, and
            # it slips in proportion to the driving force.
            push = np.gradient(true, at) / 9.8
            shrunk = 1.0 - 0.28 * (1.0 - np.cos(np.radians(lean)))
            seen = true * chance.uniform(0.98, 1.02) / shrunk * (1.0 + 0.05 * np.clip(push, -0.3, 0.5))
        else:
            wander = np.convolve(chance.standard_normal(n), np.full(5, 0.45), mode="same")
            seen = true + 0.1 * wander + 0.1 * chance.standard_normal(n)
        speed = np.full(len(time), np.nan)
        speed[np.searchsorted(time, at)] = np.maximum(seen, 0.0)
        return replace(self.log, speed_mps=speed)


def limit_ride(simulator, profile, seed, mount=None, seconds=SECONDS):
    """Return a ride with its true lean and speed as a Measured.

    simulator: "simulate" or "drawn". profile: a key of TARGETS. mount: name of a mount, or None for a firm mount.
    """
    if simulator == "drawn":
        kind = "sweepers" if profile == "sweeper" else profile
        made = drawn_ride(seed, seconds, [mount or "firm"], kind, sheet=True)
        return Measured(
            *(made.logs[0], made.calibrations[0], made.true_lean(0), made.riding(0)),
            np.interp(made.logs[0].t_s, made.time_s, made.speed_mps),
        )
    chance = np.random.default_rng([seed, 27])
    dive = chance.uniform(0.0, 6.0), chance.uniform(0.0, 3.0)
    made = ride(
        profile, seed, seconds, 1.5 * (1, -1)[seed // 2 % 2], 1.0 * (1, -1)[seed // 4 % 2], mount=mount, dive=dive
    )
    speed = made.truth["speed_mps"]
    riding = np.cumsum(speed > 0.5) > 0
    return Measured(as_log(made), calibrated_by_log(made), made.truth["lean_deg"], riding, speed)


@dataclass
class Found:
    """Errors of the lean and their standard deviations while riding. Each array has the shape (n), in degrees.

    live: errors of the live lean, NaN where it is not shown.
    live_sigma: standard deviations that the firmware computes.
    smoothed: errors of the smoothed lean.
    smoothed_sigma: standard deviations that smoothing computes.
    with_speed: {name in SPEEDS: errors of the live lean with this speed}.
    """

    live: np.ndarray
    live_sigma: np.ndarray
    smoothed: np.ndarray
    smoothed_sigma: np.ndarray
    with_speed: dict


def judge(known, seed, speeds=SPEEDS):
    shown, found, riding = replay(known.log, known.calibration), smooth(known.log, known.calibration), known.riding
    hidden = np.isnan(shown.lean_sigma_deg)
    return Found(
        np.where(hidden, np.nan, shown.lean_deg - known.lean_deg)[riding],
        shown.lean_sigma_deg[riding],
        (found.lean_deg - known.lean_deg)[riding],
        found.lean_sigma_deg[riding],
        {
            kind: np.where(np.isnan(with_it.lean_sigma_deg), np.nan, with_it.lean_deg - known.lean_deg)[riding]
            for kind in speeds
            for with_it in (replay(known.with_speed(kind, seed), known.calibration),)
        },
    )


def shares(error, sigma):
    """Return the percentages of errors within one and within two standard deviations."""
    seen = ~np.isnan(error)
    return [100.0 * float(np.mean(np.abs(error[seen]) < times * sigma[seen])) for times in (1.0, 2.0)]


def line(name, rides):
    """Return the printed line for some rides, computed from all their samples together."""
    live, live_sigma, smoothed, sigma = (
        np.concatenate([getattr(one, field) for one in rides])
        for field in ("live", "live_sigma", "smoothed", "smoothed_sigma")
    )
    seen = live[~np.isnan(live)]
    worse = sum(rms(one.smoothed) > rms(one.live[~np.isnan(one.live)]) for one in rides)
    text = f"{name:24} {len(rides):3}  {rms(seen):4.2f} {np.max(np.abs(seen)):4.1f} {100 * len(seen) / len(live):4.0f}%"
    text += "  {:3.0f} {:3.0f}%".format(*shares(live, live_sigma))
    text += f"   {rms(smoothed):4.2f} {np.max(np.abs(smoothed)):4.1f}" + "  {:3.0f} {:3.0f}%".format(
        *shares(smoothed, sigma)
    )
    text += f"  {worse:2}   "
    for kind in rides[0].with_speed:
        both = [(one.live, one.with_speed[kind]) for one in rides]
        without, measured = (
            np.concatenate([each[~np.isnan(each)] for each in some]) for some in zip(*both, strict=True)
        )
        text += f" {100 * (rms(measured) / rms(without) - 1):+4.0f}%"
    return text


HEAD = " " * 24 + " rides live worst shown  1 s  2 s   smooth worst 1 s  2 s worse  with " + ", ".join(SPEEDS)


def main(which, count, *mounts):
    """Print the figures of each profile and simulator.

    which: "odd" or "even" seeds. count: number of seeds. mounts: names of the mounts to use, or only "all". Without
        mounts, a firm mount is used.
    """
    print(HEAD, flush=True)
    for simulator, known in (("simulate", SIMULATED_MOUNTS), ("drawn", DRAWN_MOUNTS)):
        for profile in TARGETS:
            for mount in (None, *known) if mounts == ("all",) else mounts or (None,):
                if mount == "firm" or (mount and mount not in known):
                    continue
                seeds = range(which == "odd", 2 * int(count), 2)
                speeds = SPEEDS if mount is None else ()
                rides = [judge(limit_ride(simulator, profile, seed, mount), seed, speeds) for seed in seeds]
                print(line(f"{simulator} {profile} {mount or ''}", rides), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
