"""Rides of both simulators with inexact calibrations, and the lean that the display shows in them.

The program prints the table of tools/docs/accuracy.md: the errors of the shown lean and of the smoothed lean.
"""

from dataclasses import dataclass

import numpy as np
from kickstand_tools.api import replay, smooth
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.logs.log import Log

from .other_bike import other_ride
from .runs import Job, as_log, calibrated_by_poses, ride_of, rms


@dataclass
class Known:
    """A ride with its true lean."""

    log: Log  # n samples
    calibration: CalibrationFile  # of the sensor that recorded the log
    lean_deg: np.ndarray  # true lean, shape (n)
    riding: np.ndarray  # True after the bike has set off, shape (n)

    def live(self):
        """Return the lean that the firmware computes, shape (n), in degrees."""
        return replay(self.log, self.calibration).lean_deg

    def judged(self):
        """Return the errors of the lean while riding, as three arrays in degrees.

        Returns:
            live: errors of the live lean, NaN where it is not shown.
            smoothed: errors of the smoothed lean.
            sigma: standard deviations that smoothing computes.
        """
        replayed, smoothed = replay(self.log, self.calibration), smooth(self.log, self.calibration)
        live = np.where(np.isnan(replayed.lean_sigma_deg), np.nan, replayed.lean_deg - self.lean_deg)
        return live[self.riding], (smoothed.lean_deg - self.lean_deg)[self.riding], smoothed.lean_sigma_deg[self.riding]

    def part(self, selected):
        """Return the ride with only the selected samples, an array of n booleans."""
        return Known(self.log.part(selected), self.calibration, self.lean_deg[selected], self.riding[selected])


def simulated(profile, seed, seconds):
    """Return a ride of kickstand_sim.simulation.

    The upright pose is 1.5 degrees off. The pitch between the two poses is 1 degree off.
    """
    simulated_ride = ride_of(Job(profile, seed, seconds, 1.5))
    riding = np.cumsum(simulated_ride.truth["speed_mps"] > 0.5) > 0
    return Known(as_log(simulated_ride), calibrated_by_poses(simulated_ride), simulated_ride.truth["lean_deg"], riding)


def other(kind, seed, **more):
    """Return a ride of other_bike.py. more: arguments of other_ride()."""
    log, calibration, lean_deg, speed_mps = other_ride(kind, seed, **more)
    return Known(log, calibration, lean_deg, np.cumsum(speed_mps > 0.5) > 0)


ROWS = ("street", "track", "sweeper", "city", "hills", "held", "corners", "wheelie", "banked", "crosswind", "creep")
ROWS += ("temperature", "other held", "other sweepers", "other track")


@dataclass
class Figures:
    """The errors of the lean in some rides, in degrees."""

    shown_rms: float
    shown_worst: float
    smoothed_rms: float
    smoothed_worst: float
    within_1_sigma: float  # share of the smoothed lean
    within_2_sigma: float

    def __str__(self):
        within = f"{100.0 * self.within_1_sigma:.0f}, {100.0 * self.within_2_sigma:.0f} %"
        shown, smoothed = f"{self.shown_rms:.2f} ({self.shown_worst:.1f})", f"{self.smoothed_rms:.2f}"
        return f"{shown} | {smoothed} ({self.smoothed_worst:.1f}) | {within}"


def figures(row):
    """Compute the Figures of one row of the table, from four rides together."""
    kind, is_other = row.split()[-1], " " in row
    rides = [
        other(kind, seed, seconds=300.0) if is_other else simulated(kind, seed, 300.0) for seed in (201, 202, 203, 204)
    ]
    shown, off, sigma = (np.concatenate(values) for values in zip(*(ride_of_kind.judged() for ride_of_kind in rides)))
    shown = shown[~np.isnan(shown)]
    within = [float(np.mean(np.abs(off) < times * sigma)) for times in (1.0, 2.0)]
    return Figures(rms(shown), np.max(np.abs(shown)), rms(off), np.max(np.abs(off)), *within)


if __name__ == "__main__":
    for row in ROWS:
        print(f"| {row} | {figures(row)} |", flush=True)
