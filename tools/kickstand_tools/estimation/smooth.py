"""Computes the smoothed lean of a recorded ride: each lean from all readings of the ride, earlier and later."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from kickstand.lean.measurements import ROLLING_SIGMAS, ROLLING_SPEED

from ..calibration.file import ALIGN, CalibrationFile
from ..calibration.mount import read_ride
from ..checks.log import CheckedLog
from ..common.messages import InputError, Message, Remedy, is_explained, kind
from ..logs.csv_text import write_lean
from ..logs.log import PART_SAMPLES, Log, Source, Table
from ..logs.reader import time_texts
from ..logs.source import Progress
from ..signals import Array, Ints
from .least_squares import Estimate
from .model import ALL, FORWARD, GYRO, LEAN, PITCH, ROLL, Prior, corrected_rates
from .noise import jolted
from .windows import Windows, windows_of

SLOWEST_HZ = 10.0  # a log with a lower sample rate is not smoothed
SEGMENT_S = 60.0  # longest part of a log between two cuts
TOGETHER = 6  # number of segments estimated together, with one more before and one after
# LEANED_SHARE times the lean is added to the standard deviation of the lean, to cover errors that the model lacks,
# such as the gyro's sensitivity to acceleration.
LEANED_SHARE = 0.001
# TIMING_S times the roll rate is also added to this standard deviation, to cover the delay of the gyro's low-pass
# filter and errors of the samples' times.
TIMING_S = 0.002
CHUNK = 8192  # number of samples whose rates are corrected at once
COLUMNS = ("lean_deg", "lean_sigma_deg", "pitch_deg", "speed_mps", "doubtful")
DIGITS = 3, 3, 3, 3, 0
DOUBTFUL = 0.2  # a larger share of doubtful riding gets a remark
# Largest lean at which a bike balances on straights, if the upright pose was right and no luggage is on one side
POSE_DEG = 1.8
# A gyro is faulty if an estimated error is over this many standard deviations of its prior. Good gyros stayed under
# 2.6, on good and bad mounts. If a gyro is faulty, the standard deviation of the lean is multiplied
# by this error, in standard deviations of its prior.
ODD_SIGMAS = 4.0


def _pose_off_words(message) -> str:
    side = "right" if message.angle_deg > 0.0 else "left"
    return (
        f"on straights the bike is in balance {abs(message.angle_deg):.1f} degrees to the {side} of the "
        "calibration's upright, and the smoothed lean counts from there. Causes are a pose that was not upright, "
        "and a sensor without six positions; with luggage on one side the lean is wrong by that much"
    )


SensorOdd = kind(
    "sensor-odd",
    "sigmas",
    "no sound gyro fits this ride: its scale or axis error would be {sigmas:.0f} standard deviations, so the smoothed "
    "lean is not certain, and its standard deviation says so",
    Remedy("is an axis of the gyro faulty?"),
)
NotTheBikes = kind(
    "not-the-bikes",
    "percent",
    "in {percent:.0f} % of the riding the accelerations are not those of a bike on its wheels, so the smoothed lean is "
    "less exact there",
    Remedy("is the sensor in a soft mount or in a pocket? Fix it firmly"),
)
# angle_deg: the lean at which the bike is in balance, relative to the upright pose; positive to the right
PoseOff = kind("pose-off", "angle_deg", _pose_off_words)


@dataclass(eq=False)
class SmoothedRide(Table):
    """The motion of a motorcycle on a ride of n samples. Values are NaN where the readings froze.

    t_s: seconds since the log's first sample.
    lean_deg: the lean, positive to the right.
    lean_sigma_deg: standard deviation of the lean.
    pitch_deg: pitch caused by road and suspension, positive if the nose is up.
    speed_mps: forward speed of the sensor.
    doubtful: 1 where the accelerations differ from a bike's, so the lean is less exact; otherwise 0.
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

    The method is least squares over the whole ride, see model.py. Raises InputError.

    log: a speed improves the result, but is optional.
    calibration: an aligned calibration of a motorcycle.

    >>> ride = simulate_ride("street", seed=1, seconds=60.0)
    >>> calibration = CalibrationFile(vehicle_from_sensor=ride.vehicle_from_sensor, aligned=True)
    >>> smoothed = smooth(Log.from_readings(ride.readings, ride.rate_hz), calibration)
    >>> float(abs(smoothed.lean_deg - ride.truth["lean_deg"]).max()) < 10.0
    True
    """
    return smooth_checked(read_ride(log, calibration), calibration, progress)


def smooth_checked(ride: CheckedLog, calibration: CalibrationFile, progress: Progress | None = None) -> SmoothedRide:
    """Run smooth() over a checked log."""
    smoother = Smoother(ride, calibration)
    columns = np.concatenate(list(smoother.rows(progress)))
    return SmoothedRide(ride.log.t_s[ride.rows], *columns.T, notices=smoother.notices())


def smooth_to_csv(
    log: Source, calibration: CalibrationFile, out: Path, progress: Progress | None = None
) -> tuple[int, list[Message]]:
    """Write LEAN.csv with the log's own times and COLUMNS. Returns the number of samples and the notices."""
    ride = read_ride(log, calibration)
    smoother = Smoother(ride, calibration)
    count = write_lean(out, COLUMNS, DIGITS, time_texts(log, ride.log, ride.rows), smoother.rows(progress))
    return count, smoother.notices()


class Smoother:
    """Smooths a ride in batches. Collects remarks about errors that the standard deviation does not include."""

    def __init__(self, ride: CheckedLog, calibration: CalibrationFile) -> None:
        if calibration.vehicle == "car":
            raise InputError(f"{ride.log.name}: a car does not lean, and its calibration is a car's")
        if not calibration.aligned:
            raise InputError("the calibration is not aligned, so the lean is unknown", ALIGN)
        self._ride, self._calibration = ride, calibration
        temperature = ride.log.temperature_c
        self._start_c = temperature[np.argmax(~np.isnan(temperature))]  # the first temperature of the log
        self._doubtful_s = self._riding_s = self._leaned = self._odd = 0.0

    def rows(self, progress: Progress | None = None) -> Iterator[Array]:
        """Yield the values of COLUMNS for samples of the stretch, NaN for frozen readings. Raises InputError."""
        log = self._ride.log
        first, last, _ = self._ride.rows.indices(len(log.t_s))
        for span, values in self.batches(progress):
            if values is None:
                raise InputError(f"{log.name}: under {SLOWEST_HZ:.0f} samples per second: too few to smooth the lean")
            if first < span.stop and span.start < last:
                yield values[max(0, first - span.start) : last - span.start, : len(COLUMNS)]

    def batches(self, progress: Progress | None = None) -> Iterator[tuple[slice, Array | None]]:
        """Smooth the whole log in batches of several segments of SEGMENT_S.

        Yields rows of the log, at most PART_SAMPLES, and their values: those of COLUMNS, then STANDING and ROLLING.
            Frozen readings have NaN. The values are None if there are too few samples per second.
        """
        log = self._ride.log
        number = np.searchsorted(log.t_s, np.arange(0.0, log.t_s[-1] + SEGMENT_S, SEGMENT_S))
        edges = np.unique(np.append(number, len(log.t_s))).tolist()
        for k in range(0, len(edges) - 1, TOGETHER):
            end = min(k + TOGETHER, len(edges) - 1)
            # The rest of a ride may be short, so up to TOGETHER earlier segments are estimated with it
            lead = 1 if end < len(edges) - 1 else max(1, TOGETHER - (end - k))
            extended = slice(edges[max(0, k - lead)], edges[min(end + 1, len(edges) - 1)])
            span = slice(edges[k], edges[end])
            measured = self._ride.measured
            begin = int(np.count_nonzero(measured[extended.start : span.start]))
            own = slice(begin, begin + int(np.count_nonzero(measured[span])))
            part = log.part(extended)
            values = self._estimated(part if np.all(measured[extended]) else part.part(measured[extended]), own)
            if values is not None:
                rows, values = values[own], np.full((span.stop - span.start, len(COLUMNS) + 2), np.nan)
                values[measured[span]] = rows
                del rows
            for start in range(span.start, span.stop, PART_SAMPLES):
                rows = slice(start, min(start + PART_SAMPLES, span.stop))
                yield rows, None if values is None else values[start - span.start : rows.stop - span.start]
                if progress:
                    progress(rows.stop, len(log.t_s))

    def notices(self) -> list[Message]:
        """Return the remarks about the ride, after the last batch."""
        notices = self._ride.notices
        if not self._riding_s or is_explained(notices):
            return notices
        if self._odd:
            return [*notices, SensorOdd(self._odd)]
        share, pose_deg = self._doubtful_s / self._riding_s, self._leaned / self._riding_s
        notices = [*notices, NotTheBikes(100.0 * share)] if share > DOUBTFUL else notices
        return [*notices, PoseOff(pose_deg)] if abs(pose_deg) > POSE_DEG else notices

    def _estimated(self, log: Log, own: slice) -> Array | None:
        """Estimate the values of a part of the log, see batches(); NaN where the readings are not from riding.

        own: the samples that need a lean. The other samples only improve the estimate, and remarks do not count them.
        """
        t_s, temperature = log.t_s, log.temperature_c
        nothing = np.full((len(t_s), len(COLUMNS) + 2), np.nan)
        if len(t_s) < 2:
            return nothing
        if float(np.median(np.diff(t_s))) * SLOWEST_HZ > 1.0:
            return None
        valid, temperature_difference = ~np.isnan(temperature), np.zeros(len(t_s))
        if np.any(valid):
            temperature_difference = np.interp(t_s, t_s[valid], temperature[valid]) - self._start_c
        force, rate = self._calibration.in_vehicle(log.readings)
        rate = np.radians(rate)
        windows = windows_of(t_s, force, rate, log.speed_mps, temperature_difference, aligned=True)
        try:
            prior = Prior.of_pose(self._calibration.six_done, self._calibration.gyro_sigma_in_vehicle())
            estimate = Estimate(windows, prior, ALL)
        except np.linalg.LinAlgError:
            return nothing  # the readings are not from riding
        self._count(estimate, windows, np.unique(windows.number[own]))
        noise, number, sigma = estimate.noise, windows.number, estimate.sigma()
        lean = at_samples(windows, rate, estimate, sigma[:, LEAN], self._calibration.delay_s())
        lean[:, :3] = np.degrees(lean[:, :3])
        rolling = (lean[:, 3] > ROLLING_SPEED) & (lean[:, 3] > ROLLING_SIGMAS * sigma[number, FORWARD])
        odd = gyro_deviation(estimate)
        if odd > ODD_SIGMAS:
            self._odd = max(self._odd, odd)
            lean[:, 1] *= odd
        return np.column_stack((lean, noise.doubtful[number], noise.still[number], rolling)).astype(float)

    def _count(self, estimate: Estimate, windows: Windows, own: Ints) -> None:
        """Count the windows `own` for the remarks."""
        noise, seconds = estimate.noise, windows.seconds[own]
        riding_s = float(np.sum(seconds[noise.riding[own]]))
        self._riding_s += riding_s
        self._doubtful_s += float(np.sum(seconds[noise.riding[own] & noise.doubtful[own]]))
        # The lean at which the bike is in balance on straights, relative to the upright pose; positive to the right
        self._leaned += riding_s * float(np.degrees(np.mean(estimate.parameters[:, ROLL])))


def gyro_deviation(estimate: Estimate) -> float:
    """Return the gyro's largest error of scale or axes, in standard deviations of its prior."""
    return float(np.max(np.abs(estimate.parameters - estimate.prior.mean)[:, GYRO] / estimate.prior.sigma[GYRO]))


def at_samples(windows: Windows, rate: Array, estimate: Estimate, lean_sigma: Array, delay_s: float) -> Array:
    """Interpolate the estimate at each sample. Between the edges of the windows, the lean follows the corrected gyro.

    rate: the rates that were passed to windows_of(), shape (samples, 3), in rad/s.
    lean_sigma: standard deviation of the lean at the edges of the windows, in rad.
    delay_s: delay of the gyro's low-pass filter.
    Returns four columns, shape (samples, 4): lean, its standard deviation and pitch in rad, and speed in m/s.
    """
    number = windows.number
    duration = windows.before + windows.after
    last = np.append(np.diff(number) > 0, True)  # True for the last sample of each window
    window = np.cumsum(last) - last

    def integral(rate: Array) -> tuple[Array, Array]:
        """Integrate from the start of each sample's window to the sample, and over that window."""
        until = np.cumsum(rate * duration)
        edges = np.concatenate(([0.0], until[last]))
        return until - rate * windows.after - edges[window], np.diff(edges)[window]

    since, seconds = integral(np.ones(len(number)))
    share = since / seconds
    first, change = estimate.states[:-1].T, np.diff(estimate.states, axis=0).T
    lean, pitch, speed = (first[k, number] + share * change[k, number] for k in (LEAN, PITCH, FORWARD))
    middle, corrected = 0.5 * (estimate.states[:-1] + estimate.states[1:]), np.empty((3, len(number)))
    for start in range(0, len(number), CHUNK):  # each sample has 45 unknowns, which would need much memory
        rows = slice(start, start + CHUNK)
        x = estimate.unknowns(number[rows], middle[number[rows]])
        corrected[:, rows] = corrected_rates(rate[rows].T, x, windows.warm[number[rows]])
    wx, wy, wz = corrected
    roll_rate = wz - np.tan(pitch) * (wx * np.sin(lean) + wy * np.cos(lean))
    rolled, window_roll = integral(roll_rate)
    lean = first[LEAN, number] + rolled + share * (change[LEAN, number] - window_roll)
    spread = lean_sigma[number] + share * (lean_sigma[number + 1] - lean_sigma[number])
    jolt = 2.0 * np.sqrt(np.clip(share * (1.0 - share), 0.0, 1.0)) * jolted(windows)[number]
    for error in (TIMING_S * roll_rate, LEANED_SHARE * lean, jolt):
        spread = np.hypot(spread, error)
    return np.column_stack((lean + delay_s * roll_rate, spread, pitch, speed))
