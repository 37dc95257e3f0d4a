"""Checks the units of a log. The first samples show the usual mistakes: m/s2 instead of g, ms instead of s.

A wrong unit of the speed is found later. From one second to the next, the speed changes by the acceleration along the
vehicle. So the changes of the speed are compared with the specific force that caused them. The mounting of the sensor
does not matter: forward is the direction in which force and change of speed correlate best. Turns, slopes and a moving
rider add to the force only. These effects can make the change of speed seem too small, but never too large.
"""

import numpy as np
from kickstand.drive_alignment.quality import speed_unit_problem
from kickstand.units import STANDARD_GRAVITY

from ..common.errors import InputError
from ..common.messages import Message, Remedy
from ..signals import Array, Ints, best_lag
from .cells import LogCells

LEAST_G = 0.4  # gravity is missing if the median force is smaller than this; an offset of 0.6 g leaves more
MPS2_G = 5.0, 20.0  # a median force between these is in m/s2; larger values are not readings, and are left out later
MILLISECONDS_US = 4e6  # samples this far apart have times in ms that were read as s, at 250 samples per second or fewer
# Largest ratio of the logged change of speed to the change that the force explains. Speeds in knots give 1.94, and
# speeds in m/s at most 1.1.
MOST_RATIO = 1.5
PUSH_G = 0.15  # a smaller force is not used, because an ordinary road's slope causes such forces
ENOUGH = 10  # least number of seconds with this force: two or three braking events
SIGMAS = 5.0  # the correlation of force and change of speed must exceed chance by this many standard deviations
LAGS_S = np.arange(0.0, 2.1, 0.25)  # possible delays of a satellite receiver's speed
SHORTEST_S, LONGEST_S = 0.5, 2.2  # least and largest time between two speeds


class SpeedUnit(Message):
    """The speed is not in m/s. factor: the changes of the speed divided by the changes that the force explains."""

    factor: float

    code = "speed-unit"
    text = "the speed changes {factor:.1f} times as much as the force says"

    def remedy(self) -> Remedy:
        """See Message."""
        if 3.0 < self.factor < 4.4:
            return Remedy("it is in km/h, m/s are needed")
        if 1.8 < self.factor < 2.5:
            return Remedy("it is in mph or knots, m/s are needed")
        return Remedy("is it in m/s, and the right vehicle's?")


class SpeedStuck(Message):
    """The speed in the log is constant, but the vehicle speeds up and brakes."""

    speed_mps: float

    code = "speed-stuck"
    text = "the speed is stuck at {speed_mps:.1f} m/s while the vehicle speeds up and brakes"


def check_units(name: str, time_us: Ints, accel_g: Array) -> None:
    """Raise InputError for accelerations without gravity or in m/s2, and for times in ms.

    name: the log's name, for the message.
    time_us: times of the first samples of the log, shape (n).
    accel_g: accelerations of the same samples, shape (n, 3).
    """
    usual_g = np.median(np.linalg.norm(accel_g, axis=1))
    said = f"{name}: accelerations are usually {usual_g:.2f} g, where gravity makes it 1"
    if usual_g < LEAST_G:
        raise InputError(
            f"{said}: gravity has been taken off, and without it there is no lean; record the acceleration with gravity"
        )
    if MPS2_G[0] < usual_g < MPS2_G[1]:
        raise InputError(f"{said}: they look like m/s2, their unit must be g (9.80665 m/s2)")
    if len(time_us) > 1 and (time_us[-1] - time_us[0]) / (len(time_us) - 1) >= MILLISECONDS_US:
        raise InputError(f"{name}: seconds between samples: is t_s in milliseconds?")


def speed_unit(cells: LogCells) -> SpeedUnit | None:
    """Return a refusal if the speed changes too much during most of the strong forces.

    Returns None if the speed seems right, or if the log is not enough to judge it.
    """
    time_s, mps = cells.speeds.T
    seconds = np.diff(time_s)
    good = (seconds > SHORTEST_S) & (seconds < LONGEST_S)
    for lag_s in LAGS_S:
        good &= np.diff(cells.integrals(time_s - lag_s)[:, 6]) > 0.9 * seconds
    if np.count_nonzero(good) < SIGMAS * SIGMAS:
        return None
    change = np.diff(mps)[good] / (STANDARD_GRAVITY * seconds[good])

    def earlier(by_s: float) -> tuple[Array, Array]:
        return change, np.diff(cells.integrals(time_s - by_s)[:, :3], axis=0)[good] / seconds[good, None]

    best = best_lag(LAGS_S, earlier)
    if best is None or best.value * np.sqrt(len(change)) < SIGMAS:
        return None
    push = earlier(best.lag_s)[1] @ best.direction
    push, change = push - np.mean(push), change - np.mean(change)
    strong = np.abs(push) > PUSH_G
    if np.count_nonzero(strong) < ENOUGH or np.median(change[strong] / push[strong]) <= MOST_RATIO:
        return None
    # The firmware computes the factor by the same regression.
    return SpeedUnit(*speed_unit_problem(float(change @ push / (change @ change))).values)
