"""Computes the smoothed lean of a recorded ride. Each lean is computed from all readings of the ride, earlier and
later."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..calibration.file import ALIGN, CalibrationFile
from ..common.errors import InputError
from ..common.messages import Message, Remedy, is_explained
from ..logs.csv_lines import write_lean
from ..logs.log import Block, Table, within
from ..logs.reader import Source, read_blocks, split_stretch
from ..logs.source import Progress, name_of
from ..signals import Array, Bools
from .equations import corrected_rates
from .hypotheses import ALL, ROLL
from .least_squares import Estimate
from .noise import jolted
from .unknowns import FORWARD, GYRO, LEAN, PITCH, Prior
from .windows import Windows, windows_of

SLOWEST_HZ = 10.0  # a log with a lower sample rate is not smoothed
SEGMENT_S = 120.0  # longest part of a log between two cuts
TOGETHER = 8  # number of segments estimated together, with one more before and one after
# LEANED_SHARE times the lean is added to the standard deviation of the lean, to cover errors that the model lacks,
# such as the gyro's sensitivity to acceleration.
LEANED_SHARE = 0.001
# TIMING_S times the roll rate is also added to this standard deviation, to cover the delay of the gyro's low-pass
# filter and errors of the samples' times.
TIMING_S = 0.002
COLUMNS = ("lean_deg", "lean_sigma_deg", "pitch_deg", "speed_mps", "doubtful")
DIGITS = 3, 3, 3, 3, 0
DOUBTFUL = 0.2  # a larger share of doubtful riding gets a remark
# Largest lean at which a bike balances on straights, if the upright pose was right and no luggage is on one side
POSE_DEG = 1.8
# A gyro is faulty if an estimated error is over this many standard deviations of its prior. Good gyros stayed under
# 2.6, on good and bad mounts. If a gyro is faulty, the standard deviation of the lean is multiplied
# by this error, in standard deviations of its prior.
ODD_SIGMAS = 4.0


class SensorOdd(Message):
    """The gyro's errors are larger than those of any working gyro."""

    sigmas: float

    code = "sensor-odd"
    text = (
        "no sound gyro fits this ride: its scale or axis error would be {sigmas:.0f} standard deviations, so "
        "the smoothed lean is not certain, and its standard deviation says so"
    )
    todo = Remedy("is an axis of the gyro faulty?")


class NotTheBikes(Message):
    """The accelerations are not a bike's. percent: the share of the riding time with such accelerations."""

    percent: float

    code = "not-the-bikes"
    text = (
        "in {percent:.0f} % of the riding the accelerations are not those of a bike on its wheels, so the smoothed "
        "lean is less exact there"
    )
    todo = Remedy("is the sensor in a soft mount or in a pocket? Fix it firmly")


class PoseOff(Message):
    """The upright pose was not upright.

    angle_deg: the lean at which the bike is in balance, relative to the upright pose; positive to the right.
    """

    angle_deg: float

    code = "pose-off"

    def sentence(self) -> str:
        """See Message."""
        side = "right" if self.angle_deg > 0.0 else "left"
        return (
            f"on straights the bike is in balance {abs(self.angle_deg):.1f} degrees to the {side} of the "
            "calibration's upright, and the smoothed lean counts from there. Causes are a pose that was not upright, "
            "and a sensor without six positions; with luggage on one side the lean is wrong by that much"
        )


@dataclass(eq=False)
class SmoothedRide(Table):
    """The motion of a motorcycle on a ride of n samples. Values are NaN where the readings froze.

    t_s: seconds since the log's first sample.
    lean_deg: the lean, positive to the right.
    lean_sigma_deg: standard deviation of the lean.
    pitch_deg: pitch caused by road and suspension, positive if the nose is up.
    speed_mps: forward speed of the sensor.
    doubtful: 1 where the accelerations differ from a bike's, so the lean is less exact; otherwise 0.
    notices: remarks about the ride.
    """

    t_s: Array
    lean_deg: Array
    lean_sigma_deg: Array
    pitch_deg: Array
    speed_mps: Array
    doubtful: Array
    notices: list[Message] = field(default_factory=list)


def smooth(log: Source, calibration: CalibrationFile, progress: Progress | None = None) -> SmoothedRide:
    """Compute the lean of a motorcycle from all readings of its ride, with a standard deviation for each sample.

    The method is least squares over the whole ride, see equations.py.

    log: see read_log. A speed improves the result, but is optional.
    calibration: an aligned calibration of a motorcycle.
    progress: called with (done, total) of the log.
    Raises InputError.

    >>> from kickstand_tools.api import CalibrationFile, Log, simulate_ride
    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> calibration = CalibrationFile(vehicle_from_sensor=ride.vehicle_from_sensor, aligned=True)
    >>> found = smooth(Log.from_readings(ride.readings, ride.rate_hz), calibration)
    >>> float(abs(found.lean_deg - ride.truth["lean_deg"]).max()) < 10.0
    True
    """
    notices: list[Message] = []
    blocks = [(block.t_s, values) for block, values in _checked_blocks(log, calibration, progress, notices)]
    time_s, columns = (np.concatenate(parts) for parts in zip(*blocks))
    return SmoothedRide(time_s, *columns.T, notices=notices)


def smooth_to_csv(
    log: Source, calibration: CalibrationFile, out: Path, progress: Progress | None = None
) -> tuple[int, list[Message]]:
    """Write LEAN.csv with the log's own times and COLUMNS. The memory used does not grow with the log.

    Returns the number of samples and the notices. Raises InputError.
    """
    notices: list[Message] = []
    return write_lean(out, COLUMNS, DIGITS, _checked_blocks(log, calibration, progress, notices)), notices


def _checked_blocks(
    log: Source, calibration: CalibrationFile, progress: Progress | None, notices: list[Message]
) -> Iterator[tuple[Block, Array]]:
    """Yield the results of smooth_blocks() for the stretch in `log`.

    Raises InputError, also for under SLOWEST_HZ samples per second.
    """
    whole, stretch = split_stretch(log)
    for block, found in smooth_blocks(whole, calibration, progress, notices):
        if found is None:
            raise InputError(f"{name_of(log)}: under {SLOWEST_HZ:.0f} samples per second: too few to smooth the lean")
        yield from within(stretch, block, found)


def smooth_blocks(
    log: Source,
    calibration: CalibrationFile,
    progress: Progress | None = None,
    notices: list[Message] | None = None,
    lines: bool = True,
) -> Iterator[tuple[Block, Array | None]]:
    """Yield each segment of the log with its values.

    The values have the shape (n, COLUMNS). The values are None if the segment has too few samples per second.

    notices, lines: see read_blocks().
    Raises InputError.
    """
    if calibration.vehicle == "car":
        raise InputError(f"{name_of(log)}: a car does not lean, and its calibration is a car's")
    if not calibration.aligned:
        raise InputError("the calibration is not aligned, so the lean is unknown", ALIGN)
    past: list[Block] = []
    waiting: list[Block] = []
    smoother = Smoother(calibration)
    for segment in _segments(read_blocks(log, 2, progress, notices, lines=lines, calibration=calibration)):
        waiting.append(segment)
        if len(waiting) > TOGETHER:
            past, waiting, before = waiting[:TOGETHER], waiting[TOGETHER:], past[-1:]
            yield from smoother.together(before, past, waiting)
    # The rest of a ride may be short, so up to TOGETHER earlier segments are estimated with it.
    yield from smoother.together(past[-max(1, TOGETHER - len(waiting)) :], waiting, [])
    if notices is not None:
        notices.extend(smoother.remarks(notices))


def _segments(blocks: Iterator[Block]) -> Iterator[Block]:
    """Cut the blocks into segments of at most SEGMENT_S seconds."""
    for block in blocks:
        number = np.floor(block.t_s / SEGMENT_S)
        cuts = np.flatnonzero(np.diff(number)) + 1
        for begin, end in zip([0, *cuts.tolist()], [*cuts.tolist(), len(number)]):
            yield block.part(slice(begin, end))


class Smoother:
    """Smooths a ride segment by segment. Collects remarks about errors that the standard deviation does not include."""

    def __init__(self, calibration: CalibrationFile) -> None:
        self._calibration = calibration
        self._start_c = np.nan  # the first temperature of the log
        self._doubtful_s = self._riding_s = self._leaned = self._odd = 0.0

    def together(
        self, before: list[Block], own: list[Block], after: list[Block]
    ) -> Iterator[tuple[Block, Array | None]]:
        """Yield the segments `own` with their values.

        The segments before and after them are used in the same estimate, but are not returned.
        """
        measured = [segment.measured for segment in (*before, *own, *after)]
        ends = np.cumsum([0, *(len(segment.time_us) for segment in measured)])
        first = int(ends[len(before)])
        values = self.estimated(measured, slice(first, int(ends[len(before) + len(own)])))
        for segment in own:
            if values is None:
                yield segment, None
                continue
            found = np.full((len(segment.time_us), len(COLUMNS)), np.nan)
            there = ~segment.frozen
            count = int(np.count_nonzero(there))
            found[there] = values[first : first + count]
            first += count
            yield segment, found

    def estimated(self, segments: list[Block], own: slice) -> Array | None:
        """Estimate the values of the samples in these segments.

        own: the samples that need a lean. The other samples only improve the estimate, and remarks do not count them.
        Returns the values, shape (samples, COLUMNS); NaN where the readings are not from riding. Returns None
        if there are fewer than SLOWEST_HZ samples per second.
        """
        t_s = np.concatenate([segment.t_s for segment in segments])
        readings = np.concatenate([segment.readings for segment in segments])
        speed = np.concatenate([segment.speed_mps for segment in segments])
        nothing = np.full((len(t_s), len(COLUMNS)), np.nan)
        if len(t_s) < 2:
            return nothing
        if float(np.median(np.diff(t_s))) * SLOWEST_HZ > 1.0:
            return None
        there, warm = ~np.isnan(readings[:, 3]), np.zeros(len(t_s))
        if np.any(there):
            self._start_c = readings[there, 3][0] if np.isnan(self._start_c) else self._start_c
            warm = np.interp(t_s, t_s[there], readings[there, 3]) - self._start_c
        force, rate = self._calibration.in_vehicle(readings)
        rate = np.radians(rate)
        windows = windows_of(t_s, force, rate, speed, warm, aligned=True)
        try:
            prior = Prior.of_pose(self._calibration.six_done, self._calibration.gyro_sigma_in_vehicle())
            estimate = Estimate(windows, prior, ALL)
        except np.linalg.LinAlgError:
            return nothing  # the readings are not from riding
        noise, mine = estimate.noise, np.unique(windows.number[own])
        roll = float(np.mean(estimate.parameters[:, ROLL]))
        self.add(windows.seconds[mine], noise.riding[mine], noise.doubtful[mine], roll)
        doubtful = noise.doubtful[windows.number].astype(float)
        found = np.column_stack((at_samples(windows, rate, estimate, self._calibration.delay_s()), doubtful))
        found[:, :3] = np.degrees(found[:, :3])
        odd = oddness(estimate)
        if odd > ODD_SIGMAS:
            self._odd = max(self._odd, odd)
            found[:, 1] *= odd
        return found

    def add(self, seconds: Array, riding: Bools, doubtful: Bools, pose_rad: float) -> None:
        """Count n windows for the remarks.

        seconds: duration of each window, shape (n).
        riding: True where the bike may be riding, shape (n).
        doubtful: True where the accelerations are not the bike's, shape (n).
        pose_rad: the lean at which the bike is in balance on straights, relative to the upright pose; positive to the
            right.
        """
        riding_s = float(np.sum(seconds[riding]))
        self._riding_s += riding_s
        self._doubtful_s += float(np.sum(seconds[riding & doubtful]))
        self._leaned += riding_s * float(np.degrees(pose_rad))

    def remarks(self, known: Iterable[Message]) -> list[Message]:
        """Return the remarks about the whole ride. known: earlier remarks about the log."""
        if not self._riding_s or is_explained(known):
            return []
        if self._odd:
            return [SensorOdd(self._odd)]
        share, pose_deg = self._doubtful_s / self._riding_s, self._leaned / self._riding_s
        found: list[Message] = [NotTheBikes(100.0 * share)] if share > DOUBTFUL else []
        return [*found, PoseOff(pose_deg)] if abs(pose_deg) > POSE_DEG else found


def oddness(found: Estimate) -> float:
    """Return the gyro's largest error of scale or axes, in standard deviations of its prior."""
    return float(np.max(np.abs(found.parameters - found.prior.mean)[:, GYRO] / found.prior.sigma[GYRO]))


def at_samples(windows: Windows, rate: Array, found: Estimate, delay_s: float) -> Array:
    """Interpolate the estimate at each sample. Between the edges of the windows, the lean follows the corrected gyro.

    rate: the rates that were passed to windows_of(), shape (samples, 3), in rad/s.
    delay_s: delay of the gyro's low-pass filter.
    Returns four columns, shape (samples, 4): lean, its standard deviation and pitch in rad, and speed in m/s.
    """
    number, sigma = windows.number, found.sigma()[:, LEAN]
    duration = windows.before + windows.after
    last = np.append(np.diff(number) > 0, True)  # True for the last sample of each window
    window = np.cumsum(last) - last

    def integral(rate: Array) -> tuple[Array, Array]:
        """Integrate `rate`, shape (samples).

        Returns the integral from the start of each sample's window to the sample, and the integral over that window.
        """
        until = np.cumsum(rate * duration)
        edges = np.concatenate(([0.0], until[last]))
        return until - rate * windows.after - edges[window], np.diff(edges)[window]

    since, seconds = integral(np.ones(len(number)))
    share = since / seconds
    before, after = found.states[number], found.states[number + 1]
    lean, pitch, speed = (before + share[:, None] * (after - before))[:, [LEAN, PITCH, FORWARD]].T
    wx, wy, wz = corrected_rates(rate.T, found.unknowns(number, 0.5 * (before + after)), windows.warm[number])
    roll_rate = wz - np.tan(pitch) * (wx * np.sin(lean) + wy * np.cos(lean))
    rolled, whole = integral(roll_rate)
    lean = before[:, LEAN] + rolled + share * ((after - before)[:, LEAN] - whole)
    spread = sigma[number] + share * (sigma[number + 1] - sigma[number])
    jolt = 2.0 * np.sqrt(np.clip(share * (1.0 - share), 0.0, 1.0)) * jolted(windows)[number]
    for more in (TIMING_S * roll_rate, LEANED_SHARE * lean, jolt):
        spread = np.hypot(spread, more)
    return np.column_stack((lean + delay_s * roll_rate, spread, pitch, speed))
