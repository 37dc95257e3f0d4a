"""Checks a whole log without data about the vehicle: its units, and readings that were not measured.

* Noise changes the readings of a working sensor from sample to sample, even at rest. If all six axes stay the same to
  the last digit for half a second, a sensor hangs, or a phone repeats its last reading. In a log with few digits,
  rounding may hide the noise of a vehicle at rest. There, equal readings are kept if the values beside them are about
  the same.
* An axis is dead if it stays the same to the last digit while other axes of its sensor change.
* If a rate above SATURATED_DPS stays the same, the gyro is at the end of its range, so the true rate is unknown.
* Vibration may clip the accelerometer. The force between the shocks is nearly right, so the readings are used, with a
  remark.
* A wrong unit of the speed is found by its changes, which are compared with the specific force that caused them.
  Forward is the direction in which both correlate best. Turns, slopes and a moving rider add to the force only. They
  can make the change of speed seem too small, but never too large.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from kickstand.drive_alignment.quality import speed_unit_problem
from kickstand.units import AXES, STANDARD_GRAVITY

from ..common.messages import InputError, Message, RefusedInput, Remedy, kind
from ..logs.csv_text import MOST_DPS, MOST_G
from ..logs.log import Log, LogBins, Source, Stretch, log_bins
from ..logs.reader import read_log
from ..logs.source import Progress
from ..signals import Array, Bools, best_lag, bin_numbers, intervals, runs
from .axes import wrong_axes

FROZEN_S, FROZEN_SAMPLES = 0.5, 10  # shortest duration and least number of equal readings that count as frozen
COARSE_G, COARSE_DPS = 0.002, 0.05  # if readings are rounded to steps this large, rounding may hide the sensor's noise
BESIDE_S = 0.5  # equal readings are compared with the readings of this time before and after them
# Largest difference between equal readings at a standstill and the mean of the readings beside them
NEAR_G, NEAR_DPS = 0.02, 0.5

DEAD_S = 1.0  # length of the intervals in which an axis is judged
LEAST_SAMPLES = 10  # least number of samples in an interval that is judged
# An axis is judged only if the other axes change by OTHER_G or OTHER_DPS, and by OTHER_STEPS of their last digits.
# Smaller changes do not prove noise, because a phone's rounding may hide it.
OTHER_G, OTHER_DPS, OTHER_STEPS = 0.01, 0.3, 20.0
# An axis has noise if its readings turn from rising to falling, or back, at least at this share of the samples. With
# white noise they turn at two thirds of the samples. Without noise they turn at a smaller share than NOISY.
NOISY = 0.15
DEAD_ALL_S = 20.0  # a sensor whose three axes are constant from the start is dead if this lasts longer
DEAD_FROM_S = 2.0  # an axis is dead only after this time, because rounding alone may hide the noise for one second
SATURATED_DPS, SATURATED_S, SATURATED_SAMPLES = 100.0, 0.1, 5
# An accelerometer is clipped if CLIPPED_SAMPLES have the same largest reading, over CLIPPED_G. This reading
# must be over CLIPPED_STEPS steps of the last digit.
CLIPPED_G, CLIPPED_SAMPLES, CLIPPED_STEPS = 1.1, 10, 200.0
NAMES = tuple(f"{sensor} {axis}" for sensor in ("accelerometer", "gyro") for axis in AXES)

_SENSORS = slice(0, 3), slice(3, 6)

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


def _frozen_words(message) -> str:
    line = f"the readings froze from {message.begin_s:.1f} to {message.end_s:.1f} s"
    if message.stretches > 1:
        line += f" and {message.stretches - 1} times more, {message.seconds:.1f} s in all"
    return line + ": they are left out, and the lean filter restarts after each"


# stretches: number of frozen intervals, which last for `seconds` in all; begin_s, end_s: times of the first one
FrozenReadings = kind("frozen-readings", "stretches seconds begin_s end_s", _frozen_words)
# name: sensor and axis, such as "gyro x"; seconds: how long it was dead, in all; begin_s: when this began
AxisDead = kind(
    "axis-dead",
    "name seconds begin_s",
    "{name} is dead: from {begin_s:.1f} s on it does not change for {seconds:.0f} s while others do; these readings "
    "are left out, and the lean is not known there",
    Remedy("check the sensor and its solder joints, or replace it"),
)
GyroSaturated = kind(
    "gyro-saturated",
    "axis times seconds begin_s",
    "gyro {axis} is at the end of its range {times} times, {seconds:.1f} s in all, first at {begin_s:.1f} s: these "
    "readings are left out",
    Remedy("fix the sensor firmly, or set a larger GYRO_RANGE_DPS"),
)
AccelClipped = kind(
    "accel-clipped",
    "axis end_g samples begin_s",
    "accelerometer {axis} is at the end of its range ({end_g:.1f} g) in {samples} samples, first at {begin_s:.1f} s: "
    "its mean is wrong there",
    Remedy("mount the sensor more softly, or set a larger ACCEL_RANGE_G"),
)


def find_faulty(log: Log) -> tuple[Bools, list[Message]]:
    """Return True for the readings that were not measured, shape (n), and notices about them and clipped readings."""
    axes = _axes(log)
    steps = _steps(axes)
    frozen, notices = _frozen(log.t_s, axes, steps)
    faulty = frozen.copy()
    if len(log.t_s) >= LEAST_SAMPLES:
        notices += _dead(log.t_s, axes, steps, faulty)
        for name, rate in zip(AXES, axes[3:]):
            notices += _saturated(name, log.t_s, rate, faulty)
        for name, force, step in zip(AXES, axes[:3], steps):
            notices += _clipped(name, log.t_s, force, step)
    return faulty, notices


def without_frozen(log: Log) -> Log:
    """Return the log without frozen readings, which become gaps, or the same log if it has none."""
    axes = _axes(log)
    frozen, _ = _frozen(log.t_s, axes, _steps(axes))
    return log.part(~frozen) if np.any(frozen) else log


def _axes(log: Log) -> list[Array]:
    return [*log.accel_g.T, *log.gyro_dps.T]


def _steps(axes: list[Array]) -> Array:
    """Return the smallest change of each axis, which is the step of its last digit, shape (6); infinite without one."""
    changes = (np.abs(np.diff(values)) for values in axes)
    return np.array([np.min(change[change > 1e-9], initial=np.inf) for change in changes])


def _frozen(time_s: Array, axes: list[Array], steps: Array) -> tuple[Bools, list[Message]]:
    """Return True for frozen readings, and their notice. The first of equal readings counts as measured."""
    same = np.ones(max(0, len(time_s) - 1), dtype=bool)
    for values in axes:
        same &= values[1:] == values[:-1]
    frozen = np.zeros(len(time_s), dtype=bool)
    times: list[tuple[float, float]] = []
    for first, last in intervals(same):  # the readings first to last, inclusive, are equal
        long = time_s[last] - time_s[first] >= FROZEN_S and last - first + 1 >= FROZEN_SAMPLES
        if long and not _may_stand(time_s, axes, steps, int(first), int(last) + 1):
            frozen[first + 1 : last + 1] = True
            times.append((float(time_s[first]), float(time_s[last])))
    seconds = sum(end_s - begin_s for begin_s, end_s in times)
    return frozen, [FrozenReadings(len(times), seconds, *times[0])] if times else []


def _may_stand(time_s: Array, axes: list[Array], steps: Array, begin: int, end: int) -> bool:
    """Return True if the equal readings from begin to end may be a standstill whose noise is hidden by rounding."""
    if not np.any(np.isfinite(steps)):
        return True  # without any change, the size of the last digit is unknown
    if np.any(steps[:3] < COARSE_G) or np.any(steps[3:] < COARSE_DPS):
        return False
    near = 0.5 * np.where(np.isfinite(steps), steps, 0.0) + np.repeat([NEAR_G, NEAR_DPS], 3)
    first = int(np.searchsorted(time_s, time_s[begin] - BESIDE_S, side="right"))
    last = int(np.searchsorted(time_s, time_s[end - 1] + BESIDE_S))
    for rows in slice(first, begin), slice(end, last):
        if rows.start < rows.stop:
            distances = [abs(float(np.mean(values[rows])) - values[begin]) for values in axes]
            if np.all(np.array(distances) <= near):
                return True
    return False


def _dead(time_s: Array, axes: list[Array], steps: Array, faulty: Bools) -> list[Message]:
    """Find dead axes, second by second. Mark their readings in `faulty`. Returns the notices."""
    begins = runs(bin_numbers(time_s, DEAD_S))
    ends = np.append(begins[1:], len(time_s))
    spread, noisy = np.empty((len(begins), 6)), np.empty((len(begins), 6), dtype=bool)
    for k, values in enumerate(axes):
        spread[:, k] = np.maximum.reduceat(values, begins) - np.minimum.reduceat(values, begins)
        slope = np.diff(values)
        turns = np.zeros(len(values), dtype=bool)
        turns[1:-1] = slope[1:] * slope[:-1] < 0.0
        noisy[:, k] = np.add.reduceat(turns, begins, dtype=float) >= NOISY * (ends - begins)
    judged = ends - begins >= LEAST_SAMPLES
    dead = _dead_seconds(spread, noisy, steps, judged, long=time_s[-1] - time_s[0] > DEAD_ALL_S)
    seconds = time_s[ends - 1] - time_s[begins]
    notices: list[Message] = []
    for name, axis in zip(NAMES, dead.T):
        dead_s, first_s = 0.0, 0.0
        for begin, end in intervals(axis | ~judged):  # a second with too few samples does not interrupt
            rows = begin + np.flatnonzero(axis[begin:end])
            if len(rows) * DEAD_S >= DEAD_FROM_S:
                faulty[begins[rows[0]] : ends[rows[-1]]] = True
                first_s = first_s if dead_s else float(time_s[begins[rows[0]]])
                dead_s += float(np.sum(seconds[rows]))
        notices += [AxisDead(name, dead_s, first_s)] if dead_s >= DEAD_FROM_S else []
    return notices


def _dead_seconds(spread: Array, noisy: Bools, steps: Array, judged: Bools, long: bool) -> Bools:
    """Return True for the dead axes in each of m seconds, shape (m, 6).

    spread: largest minus smallest reading of each axis, shape (m, 6).
    noisy: True for axes with noise, shape (m, 6).
    judged: True for seconds with enough samples, shape (m).
    long: True if the log is long enough to judge a sensor that never changes.
    """
    last_digit = np.where(np.isfinite(steps), steps, 0.0)
    moves = noisy & (spread >= np.maximum(np.repeat([OTHER_G, OTHER_DPS], 3), OTHER_STEPS * last_digit))
    moves &= judged[:, None]
    dead = (spread <= 0.0) & judged[:, None]
    for sensor, other in (_SENSORS, _SENSORS[::-1]):
        moving = np.any(moves[:, sensor], axis=1)
        still = np.all(dead[:, sensor], axis=1)
        # In simulated logs a gyro may have no noise, so its readings do not change on straights
        has_noise = bool(np.any(moving)) or (long and bool(np.all(still[judged])))
        dead_together = np.any(moves[:, other], axis=1) & has_noise
        dead[:, sensor] &= np.where(still, dead_together, moving)[:, None]
    return dead


def _saturated(name: str, time_s: Array, rate: Array, faulty: Bools) -> list[Message]:
    """Find the times at which the gyro was at the end of its range. Mark them in `faulty`. Returns the notice."""
    begins = runs(rate)
    ends = np.append(begins[1:], len(rate))
    long = (ends - begins >= SATURATED_SAMPLES) & (np.abs(rate[begins]) > SATURATED_DPS)
    long &= time_s[ends - 1] - time_s[begins] >= SATURATED_S
    begins, ends = begins[long], ends[long]
    for begin, end in zip(begins, ends):
        faulty[begin:end] = True
    seconds = float(np.sum(time_s[ends - 1] - time_s[begins]))
    return [GyroSaturated(name, len(begins), seconds, float(time_s[begins[0]]))] if len(begins) else []


def _clipped(name: str, time_s: Array, force: Array, step: float) -> list[Message]:
    """Return the notice that vibration clipped an axis. A log with few digits may repeat its largest reading."""
    limits_g, clipped = [], np.zeros(len(force), dtype=bool)
    for sign, most_g in ((1.0, float(np.max(force))), (-1.0, -float(np.min(force)))):
        at_limit = force == sign * most_g
        is_large = most_g >= max(CLIPPED_G, np.nextafter(CLIPPED_STEPS * step, np.inf))
        if is_large and np.count_nonzero(at_limit) >= CLIPPED_SAMPLES:
            limits_g.append(most_g)
            clipped |= at_limit
    if not limits_g:
        return []
    return [AccelClipped(name, limits_g[0], int(np.count_nonzero(clipped)), float(time_s[np.argmax(clipped)]))]


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
    log = read_log(source.source if isinstance(source, Stretch) else source, progress=progress)
    rows = log.rows_between(source.from_s, source.to_s) if isinstance(source, Stretch) else slice(None)
    return replace(check_log(log), rows=rows)


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
