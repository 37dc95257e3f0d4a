"""Checks a whole log, and marks readings that were not measured. The checks need no data about the vehicle.

The first samples show the usual mistakes of units: m/s2 instead of g, ms instead of s. A wrong unit of the speed is
found by its changes: from one second to the next, the speed changes by the acceleration along the vehicle. So the
changes of the speed are compared with the specific force that caused them. The mounting of the sensor does not matter:
forward is the direction in which force and change of speed correlate best. Turns, slopes and a moving rider add to the
force only. These effects can make the change of speed seem too small, but never too large.
"""

from dataclasses import dataclass, field

import numpy as np
from kickstand.drive_alignment.quality import speed_unit_problem
from kickstand.units import STANDARD_GRAVITY

from ..common.messages import InputError, Message, RefusedInput, Remedy, kind
from ..logs.csv_text import MOST_DPS, MOST_G
from ..logs.log import Log, LogBins, Source, log_bins
from ..logs.reader import read_log, read_with_rows
from ..logs.source import Progress
from ..signals import Array, Bools, best_lag
from .axes import wrong_axes
from .sensor import find_faulty

FIRST = 15_000  # number of samples by which the units of force and time are judged
LEAST_G = 0.4  # gravity is missing if the median force is smaller than this; an offset of 0.6 g leaves more
MPS2_G = 5.0, 20.0  # a median force between these is in m/s2; larger values are not readings, and are left out
MILLISECONDS_S = 4.0  # samples this far apart have times in ms that were read as s, at 250 samples per second or fewer
# Largest ratio of the logged change of speed to the change that the force explains. Speeds in knots give 1.94, and
# speeds in m/s at most 1.1.
MOST_RATIO = 1.5
PUSH_G = 0.15  # a smaller force is not used, because an ordinary road's slope causes such forces
ENOUGH = 10  # least number of seconds with this force: two or three braking events
SIGMAS = 5.0  # the correlation of force and change of speed must exceed chance by this many standard deviations
LAGS_S = np.arange(0.0, 2.1, 0.25)  # possible delays of a satellite receiver's speed
SHORTEST_S, LONGEST_S = 0.5, 2.2  # least and largest time between two speeds


def _speed_unit_remedy(message) -> Remedy:
    if 3.0 < message.factor < 4.4:
        return Remedy("it is in km/h, m/s are needed")
    if 1.8 < message.factor < 2.5:
        return Remedy("it is in mph or knots, m/s are needed")
    return Remedy("is it in m/s, and the right vehicle's?")


# factor: the changes of the speed divided by the changes that the force explains
SpeedUnit = kind(
    "speed-unit", "factor", "the speed changes {factor:.1f} times as much as the force says", _speed_unit_remedy
)
SpeedStuck = kind(
    "speed-stuck",
    "speed_mps",
    "the speed is stuck at {speed_mps:.1f} m/s while the vehicle speeds up and brakes",
)


@dataclass
class CheckedLog:
    """A log of n samples with the results of its checks."""

    log: Log  # the whole log
    measured: Bools  # False for readings that were not measured and must be left out, shape (n)
    notices: list[Message]  # remarks about the log
    rows: slice = field(default_factory=lambda: slice(None))  # the rows of the stretch that is asked for
    bins: LogBins | None = None  # averages of the log for further checks; None if the log has no readings for them


def check_log(log: Log, axes: bool = True, sensor: bool = True) -> CheckedLog:
    """Check units, sensor, axes and speed of a log. It has at most one remark about its axes.

    axes: check that rates and accelerations fit each other. This check takes most of the time.
    sensor: look for readings that the sensor has not measured.
    Raises InputError for accelerations without gravity or in m/s2, and for times in ms. Raises its subclass
    RefusedInput for a speed that is not in m/s.

    >>> import numpy as np
    >>> from kickstand_tools.api import Log, simulate_ride
    >>> ride = simulate_ride("street", seed=1, seconds=90.0)
    >>> log = Log.from_readings(ride.readings, ride.rate_hz)
    >>> log.gyro_dps = -log.gyro_dps
    >>> [notice.code for notice in check_log(log).notices]
    ['left-handed']
    """
    _check_units(log)
    faulty, notices = find_faulty(log) if sensor else (np.zeros(len(log.t_s), bool), [])
    measured = ~faulty
    bins = _bins(log, measured)
    if bins is not None:
        problem = speed_unit(bins)
        if problem:
            raise RefusedInput(problem, log.name)
        problem = wrong_axes(bins) if axes else None
        notices += [problem] if problem else []
    return CheckedLog(log, measured, [*log.notices, *notices], bins=bins)


def read_checked(source: Source, progress: Progress | None = None) -> CheckedLog:
    """Read and check the whole log of a source, of which a Stretch selects the rows. See read_log() and check_log()."""
    log, rows = read_with_rows(source, progress)
    checked = check_log(log)
    checked.rows = rows
    return checked


def read_with_notices(source: Source, axes: bool = True, sensor: bool = False) -> Log:
    """Read and check a log, or a stretch as a log of its own. Its notices include those of check_log().

    sensor: True if the caller leaves out the readings that the sensor has not measured; the log keeps them.
    """
    log = read_log(source)
    log = log.part(slice(None))  # a copy, because the source may be the user's own Log
    log.notices = check_log(log, axes, sensor).notices
    return log


def _bins(log: Log, measured: Bools) -> LogBins | None:
    """Return the bins of the measured readings within the sensors' ranges: one huge reading would outweigh a ride."""
    used = measured.copy()
    for vectors, limit in ((log.accel_g, MOST_G), (log.gyro_dps, MOST_DPS)):
        for values in vectors.T:
            used &= np.abs(values) <= limit
    return log_bins(log if np.all(used) else log.part(used))


def _check_units(log: Log) -> None:
    """Raise InputError for accelerations without gravity or in m/s2, and for times in ms."""
    time_s, force = log.t_s[:FIRST], log.accel_g[:FIRST]
    if not len(time_s):
        return
    usual_g = np.median(np.linalg.norm(force, axis=1))
    problem = f"{log.name}: accelerations are usually {usual_g:.2f} g, where gravity makes it 1"
    if usual_g < LEAST_G:
        raise InputError(
            f"{problem}: gravity has been taken off, and without it there is no lean; record the acceleration with "
            "gravity"
        )
    if MPS2_G[0] < usual_g < MPS2_G[1]:
        raise InputError(f"{problem}: they look like m/s2, their unit must be g (9.80665 m/s2)")
    if len(time_s) > 1 and (time_s[-1] - time_s[0]) / (len(time_s) - 1) >= MILLISECONDS_S:
        raise InputError(f"{log.name}: seconds between samples: is t_s in milliseconds?")


def speed_unit(bins: LogBins) -> Message | None:
    """Return a refusal if the speed changes too much during most of the strong forces; None as wrong_axes()."""
    time_s, mps = bins.speeds.T
    seconds = np.diff(time_s)
    good = (seconds > SHORTEST_S) & (seconds < LONGEST_S)
    for lag_s in LAGS_S:
        good &= np.diff(bins.integrals(time_s - lag_s)[:, 6]) > 0.9 * seconds
    if np.count_nonzero(good) < SIGMAS * SIGMAS:
        return None
    change = np.diff(mps)[good] / (STANDARD_GRAVITY * seconds[good])

    def earlier(by_s: float) -> tuple[Array, Array]:
        return change, np.diff(bins.integrals(time_s - by_s)[:, :3], axis=0)[good] / seconds[good, None]

    best = best_lag(LAGS_S, earlier)
    if best is None or best.value * np.sqrt(len(change)) < SIGMAS:
        return None
    push = earlier(best.lag_s)[1] @ best.direction
    push, change = push - np.mean(push), change - np.mean(change)
    strong = np.abs(push) > PUSH_G
    if np.count_nonzero(strong) < ENOUGH or np.median(change[strong] / push[strong]) <= MOST_RATIO:
        return None
    # The firmware computes the factor by the same regression
    return SpeedUnit(*speed_unit_problem(float(change @ push / (change @ change))).values)
