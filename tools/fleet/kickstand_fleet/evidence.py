"""Collects the normal equations of a regression that finds the sensor's alignment, in blocks of some seconds.

As in the firmware's ForwardRegression, the regression explains the mean force f between two consecutive speeds of the
log. The time between these two speeds is called an interval. In a car, in the sensor's own axes:

    f = level + forward a + left c + arm w

    a = dv/dt / g               acceleration forward
    c = v (yaw rate) / g        acceleration to the left
    w = d(yaw rate)/dt          change of the yaw rate

level, forward, left and arm are vectors, the coefficients. Unlike the firmware, this regression also uses bends. In a
car, bends show which way is left, just as braking shows which way is forward.

A sensor ahead of the rear axle is accelerated sideways when a bend begins and ends. Drivers brake and speed up at the
same moments, so this acceleration would falsify forward. The coefficient arm takes up this acceleration. The length of
the vector `arm` is the distance from the sensor to the rear axle.

A motorcycle leans into bends. The force stays along the motorcycle's own up, and grows to sqrt(1 + c^2). So for a
motorcycle

    f = level sqrt(1 + c^2) + forward a

A car's body also sways on its springs, mostly sideways. The direction of the sway depends on the vehicle, but stays the
same. If the direction changes in the sensor's axes, the mount has moved.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

import numpy as np
from kickstand.drive_alignment.alignment import MOTORCYCLE
from kickstand.drive_alignment.events import MAX_INTERVAL_US
from kickstand.drive_alignment.quality import AGREE_DEG, READY_DEG
from kickstand.units import GAP_US, STANDARD_GRAVITY
from kickstand_tools.calibration.drive import UP_DEG, DriveFit
from kickstand_tools.logs.log import Log, Table
from kickstand_tools.signals import STANDING_MPS, Array, moving_mean, rotation_vector, runs

INTERVAL_S = 0.9  # of speeds that are closer together, only the first is used
MOVING_MPS = 2.0
# Weight of a second at a standstill, compared with a second of driving. The weight is small, because even a long stop
# shows the slope of the road at one place only
STANDING_WEIGHT = 0.3
LEVEL_S = 20.0  # the mean force over this time is roughly vertical. The rate about this direction is the yaw rate
BLOCK_S = 8.0
# ROAD_SHARE is the variance of the road's slope, divided by the variance of all other errors in a mean over 1 s.
# ROAD_M is the correlation length of the road's slope, in m
ROAD_SHARE, ROAD_M = 1.0, 150.0
SWING_S = 0.2  # averaging time of the yaw rate at each end of an interval
# Sway is the mean force over the first time minus the mean force over the second time. The first mean removes noise,
# the difference removes braking, speeding up and bends
SWAY_S = 0.05, 0.3
# Yaw rate at which an interval of a car has half of its usual weight. In a tight bend, a sensor ahead of the rear axle
# does not move along the vehicle's heading. Its direction of motion differs from the heading by an angle: the distance
# from sensor to rear axle, divided by the bend's radius.
TIGHT_DPS = 20.0


@dataclass
class Intervals:
    """n intervals of a log. Each interval lasts from one speed to the next speed."""

    t_s: Array  # middle of each interval, shape (n), in s from the log's beginning
    force: Array  # mean force of each interval, shape (n, 3), in g along the sensor's axes
    terms: Array  # the regressors of level, forward, left and arm, shape (n, 4)
    weight: Array  # weight of each interval, shape (n), in s
    speed: Array  # mean speed of each interval, shape (n), in m/s
    # Covariance of the quick changes of force, shape (n, 3, 3), in g^2. Zero for intervals without usable sway.
    sway: Array


@dataclass
class Blocks(Table):
    """m consecutive blocks of intervals in one or several logs."""

    # Sums of products of two terms, shape (m, 4, 4). The road's slope is filtered out, see _without_road().
    square: Array
    product: Array  # sums of products of a term and a component of the force, shape (m, 4, 3), filtered like square
    # Sway of each block, shape (m, 3, 3). The matrix is divided by its trace, so a rough road counts like a smooth
    # road.
    sway: Array
    log: Array  # index of each block's log, shape (m)
    t_s: Array  # beginning of each block in its log, shape (m), in s
    end_s: Array  # end of each block in its log, shape (m), in s


def intervals(log: Log, kind: str, lag_s: float, bias_dps: Array) -> Intervals:
    """Compute the intervals of a log.

    kind: "motorcycle" or "car". lag_s: delay of the log's speed. bias_dps: the gyro's bias along the sensor's axes.
    """
    step = np.diff(log.t_s, prepend=log.t_s[0])
    step = np.where(step * 1e6 > GAP_US, 0.0, step)
    rate = np.radians(log.gyro_dps - bias_dps)
    time, speed = _thinned_speeds(log, lag_s)
    curve = rate * (np.interp(log.t_s, time, speed) / STANDARD_GRAVITY)[:, None]
    sway = _sway(log)
    squares = (first * second for first in sway.T for second in sway.T)
    ends = _integrals(chain(log.accel_g.T, curve.T, squares), log.t_s, step, time)
    seconds, sampled_s = np.diff(time), np.diff(np.interp(time, log.t_s, np.cumsum(step)))
    usable = (seconds <= MAX_INTERVAL_US * 1e-6) & (sampled_s > 0.9 * seconds)
    means = (np.diff(ends, axis=0) / np.maximum(sampled_s, 1e-9)[:, None])[usable]
    mean_force, mean_curve, mean_squares = means[:, :3], means[:, 3:6], means[:, 6:]
    middle, length = (time[1:] - seconds / 2.0)[usable], seconds[usable]
    mean_mps = (0.5 * (speed[1:] + speed[:-1]))[usable]
    forward_g = (np.diff(speed) / seconds / STANDARD_GRAVITY)[usable]
    up = _local_up(middle, mean_force, length)
    centripetal_g = np.sum(mean_curve * up, axis=1)
    moving = mean_mps > MOVING_MPS
    if kind == MOTORCYCLE:
        none = np.zeros_like(forward_g)
        terms = np.column_stack((np.sqrt(1.0 + centripetal_g**2), forward_g, none, none))
        # A motorcycle at a lower speed has no weight, because the rider may have a foot on the ground
        weight = length * moving
        has_sway = none  # no sway, because a motorcycle sways about its tyre contacts and with its rider
    else:
        yaw_acceleration = np.sum(_change_of_rate(log, rate, step, time)[usable] * up, axis=1) / length
        terms = np.column_stack((np.ones_like(forward_g), forward_g, centripetal_g, yaw_acceleration))
        weight = _weight_of_car(length, mean_mps, forward_g, centripetal_g)
        has_sway = moving.astype(float)
    sway_squares = (mean_squares * has_sway[:, None]).reshape(-1, 3, 3)
    return Intervals(middle, mean_force, terms, weight, mean_mps, sway_squares)


def _change_of_rate(log: Log, rate: Array, step: Array, time: Array) -> Array:
    """Return the change of the rate from each time to the next, shape (len(time) - 1, 3), in rad/s."""
    edges = [np.clip(time + offset_s, log.t_s[0], log.t_s[-1]) for offset_s in (-SWING_S / 2.0, SWING_S / 2.0)]
    (begin_s, end_s), (begin, end) = edges, (_integrals(rate.T, log.t_s, step, edge) for edge in edges)
    return np.diff((end - begin) / np.maximum(end_s - begin_s, 1e-9)[:, None], axis=0)


def _weight_of_car(length: Array, mps: Array, forward_g: Array, centripetal_g: Array) -> Array:
    """Return the weight of each interval of a car, shape (n), in s."""
    standing = (mps < STANDING_MPS) & (np.abs(forward_g) < 0.01)
    turning_dps = np.degrees(centripetal_g * STANDARD_GRAVITY / np.maximum(mps, MOVING_MPS))
    return length * np.where(standing, STANDING_WEIGHT, mps > STANDING_MPS) / (1.0 + (turning_dps / TIGHT_DPS) ** 2)


def blocks(logs: list[Intervals]) -> Blocks:
    """All intervals of the logs in blocks of about BLOCK_S."""
    square, product, sway, log_index, begin_s, end_s = [], [], [], [], [], []
    for index, log in enumerate(logs):
        if not len(log.t_s):
            continue
        starts = runs(np.floor((log.t_s - log.t_s[0]) / BLOCK_S))
        terms, force = _without_road(log)
        square.append(np.add.reduceat(terms[:, :, None] * terms[:, None, :], starts))
        product.append(np.add.reduceat(terms[:, :, None] * force[:, None, :], starts))
        swayed = np.add.reduceat(log.sway, starts)
        sway.append(swayed / np.maximum(np.trace(swayed, axis1=1, axis2=2), 1e-12)[:, None, None])
        log_index.append(np.full(len(starts), index))
        begin_s.append(log.t_s[starts])
        end_s.append(log.t_s[np.append(starts[1:], len(log.t_s)) - 1])
    if not square:
        empty = np.zeros(0)
        return Blocks(np.zeros((0, 4, 4)), np.zeros((0, 4, 3)), np.zeros((0, 3, 3)), np.zeros(0, int), empty, empty)
    return Blocks(*(np.concatenate(parts) for parts in (square, product, sway, log_index, begin_s, end_s)))


def fits(square: Array, product: Array) -> tuple[Array, Array]:
    """Solve k systems of normal equations with t terms.

    square, product: See Blocks, shapes (k, t, t) and (k, t, 3).

    Returns:
        coefficients: level, forward, left and, if t is 4, arm, shape (k, t, 3).
        variation: of the regressors a and c of the module's docstring, shape (k, 2), in g^2 s.
    """
    ridge = np.diag([1e-9] + [1e-6] * (square.shape[-1] - 1)) * np.maximum(square[..., :1, :1], 1e-3)
    coefficients = np.asarray(np.linalg.solve(square + ridge, product), dtype=float)
    seconds = np.maximum(square[..., 0, 0], 1e-9)[..., None]
    means = square[..., 0, 1:3] / seconds
    varied = np.diagonal(square, axis1=-2, axis2=-1)[..., 1:3] - seconds * means * means
    return coefficients, varied


def frames(coefficients: Array, varied: Array) -> Array:
    """Compute k rotations from sensor to vehicle axes, shape (k, 3, 3), from the two results of fits()."""
    level, forward, left = coefficients[..., 0, :], coefficients[..., 1, :], coefficients[..., 2, :]
    up = level / np.maximum(np.linalg.norm(level, axis=-1, keepdims=True), 1e-9)
    ahead = varied[..., :1] * forward + varied[..., 1:] * np.cross(left, up)
    return frame_of(up, np.asarray(ahead, dtype=float))


def alignment(square: Array, product: Array) -> tuple[Array, Array]:
    """Compute the alignment from m blocks, and its variance by a jackknife: from the alignments without each block.

    square, product: See Blocks, shapes (m, t, t) and (m, t, 3).
    Returns the rotation from sensor to vehicle axes, shape (3, 3), with the rows left, up, forward, and the variances
    of pitch, yaw and roll, shape (3), in degrees^2.
    """
    squares, products, count = np.sum(square, axis=0), np.sum(product, axis=0), len(square)
    frame = frames(*fits(squares, products))
    off_deg = np.degrees(rotation_vector(frames(*fits(squares - square, products - product)) @ frame.T))
    return frame, (count - 1) / count * np.sum(off_deg * off_deg, axis=0)


def frame_of(up: Array, ahead: Array) -> Array:
    """Compute rotations from sensor to vehicle axes, shape (..., 3, 3), with the rows left, up, forward.

    up: Unit vectors, shape (..., 3).
    ahead: Vectors that point roughly forward, shape (..., 3).
    """
    side = np.cross(up, ahead)
    side /= np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-9)
    return np.asarray(np.stack((side, up, np.cross(side, up)), axis=-2), dtype=float)


def handedness(coefficients: Array, varied: Array) -> float:
    """Divide the lateral force measured in bends by the lateral force computed from speed and yaw rate.

    The ratio is about 1, or -1 if the gyro's signs or the axes are mirrored. It is 0 without bends, and for a
    motorcycle, which leans into bends. The arguments are the two results of fits() for one system.
    """
    if varied[1] < 0.05:
        return 0.0
    level, forward, left = coefficients[:3]
    side = np.cross(level, forward)
    return float(side @ left / max(float(np.linalg.norm(side)), 1e-9))


def _without_road(log: Intervals) -> tuple[Array, Array]:
    """Return the terms and the force with the slope and camber of the road filtered out.

    Slope and camber stay similar for some hundred metres, and tilt the measured level. An ordinary regression would
    mistake the slope during braking for a part of forward. Therefore a filter follows the road, modelled as a
    first-order Gauss-Markov process in distance, and predicts each value from the earlier intervals. The results are
    the differences from the predictions, divided by their standard deviations. They are uncorrelated, so ordinary least
    squares can be used on them.
    """
    rows = np.hstack((log.terms, log.force))
    driven_m = log.speed * np.diff(log.t_s, prepend=log.t_s[0])
    memory = np.exp(-driven_m / ROAD_M)
    predicted, variance = np.zeros(rows.shape[1]), ROAD_SHARE
    for k, weight in enumerate(log.weight.tolist()):
        predicted = predicted * memory[k]
        variance = ROAD_SHARE + (variance - ROAD_SHARE) * memory[k] ** 2
        gain = variance * weight / (variance * weight + 1.0)
        rows[k] -= predicted
        predicted = predicted + gain * rows[k]
        rows[k] *= math.sqrt(weight * (1.0 - gain))
        variance *= 1.0 - gain
    return rows[:, :-3], rows[:, -3:]


def sway_deg(sway: Array, frame: Array) -> Array:
    """Compute the horizontal direction of the largest sway, shape (k), from forward towards left, -90 to 90 degrees.

    sway: covariances in the sensor's axes, shape (k, 3, 3). frame: rotation from sensor to vehicle axes.
    """
    level = frame[[0, 2]] @ sway @ frame[[0, 2]].T
    return np.degrees(0.5 * np.arctan2(2.0 * level[..., 0, 1], level[..., 1, 1] - level[..., 0, 0]))


def _sway(log: Log) -> Array:
    """Return the quick changes of force (see SWAY_S), shape (n, 3), in g."""
    step_s = float(np.median(np.diff(log.t_s)))
    quick, slow = (moving_mean(log.accel_g, round(width_s / step_s)) for width_s in SWAY_S)
    return quick - slow


def _integrals(columns: Iterable[Array], t_s: Array, step: Array, time: Array) -> Array:
    """Integrate k columns of samples from the log's beginning until the times `time`, shape (len(time), k).

    step: time since the previous sample, 0 after a gap. Works column by column, to limit memory.
    """
    return np.array([np.interp(time, t_s, np.cumsum(column * step)) for column in columns]).T


def _thinned_speeds(log: Log, lag_s: float) -> tuple[Array, Array]:
    """Return the times and the values of at most one speed per INTERVAL_S, without the delay of the speed."""
    valid = np.flatnonzero(~np.isnan(log.speed_mps))
    time, speed = log.t_s[valid] - lag_s, log.speed_mps[valid]
    selected, last_s = [], -np.inf
    for k, time_s in enumerate(time.tolist()):
        if time_s >= 0.0 and time_s - last_s >= INTERVAL_S:
            selected.append(k)
            last_s = time_s
    return time[selected], speed[selected]


def _local_up(middle: Array, force: Array, length: Array) -> Array:
    """Return the direction of the mean force during the LEVEL_S around each interval: unit vectors, shape (n, 3)."""
    sums = np.vstack((np.zeros(3), np.cumsum(force * length[:, None], axis=0)))
    first = np.searchsorted(middle, middle - LEVEL_S / 2.0)
    last = np.searchsorted(middle, middle + LEVEL_S / 2.0, side="right")
    up = sums[last] - sums[first]
    return up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-9)


SENSOR_DEG = 0.3  # standard error of forward, in degrees, caused by a scale difference of 1 % between the sensor's axes
# Correlation between the errors of the firmware's and this module's forward, which use the same braking
CORRELATION = 0.5
# Largest difference between the two methods, in standard deviations, that does not increase the standard error of
# forward
APART_SIGMAS = 2.0
# Number of coefficients of py that are fitted: level, forward and left. The fourth coefficient, arm, is useful
# only to compare parts of a drive. When arm was fitted to whole drives, forward was wrong by 2 degrees in one of three
# recorded drives. Without arm, the error was at most 0.6 degrees in all three drives.
_TERMS = 3
_LEAST_BLOCKS = 4


@dataclass
class Forward:
    frame: Array  # rotation from sensor to vehicle axes, shape (3, 3). Its rows are left, up, forward.
    sigma_deg: float  # standard error of forward about up
    attitude_deg: float  # standard error of the whole rotation
    halves_deg: float  # angle between forward from the first half of the driving and forward from the second half

    @property
    def sure(self) -> bool:
        return self.sigma_deg <= READY_DEG and abs(self.halves_deg) <= AGREE_DEG


def find_forward(logs: list[Intervals], device: DriveFit | None = None) -> Forward | None:
    """Compute the alignment from the intervals of each log. Returns None if the logs do not determine it.

    device: The firmware's alignment from the same logs, or None if the firmware refuses them. It is the result for a
        drive with too few blocks for this module's alignment.
    """
    driving = blocks(logs)
    count = len(driving.log)
    if count < _LEAST_BLOCKS:
        return _alone(device) if device else None
    square, product = driving.square[:, :_TERMS, :_TERMS], driving.product[:, :_TERMS]

    frame, (pitch, yaw, roll) = alignment(square, product)
    variance = float(yaw) + SENSOR_DEG**2
    early, late = (
        frames(*fits(np.sum(square[half], axis=0), np.sum(product[half], axis=0)))
        for half in (slice(count // 2), slice(count // 2, None))
    )
    halves_deg = float(_yaw_deg(late, early))
    if device is not None:
        frame, variance = _mean(frame, variance, device.calibration.vehicle_from_sensor, device.quality_deg)
    attitude = variance + float(pitch + roll) + UP_DEG**2
    return Forward(frame, float(np.sqrt(variance)), float(np.sqrt(attitude)), abs(halves_deg))


def _alone(device: DriveFit) -> Forward:
    sigma = float(np.hypot(device.quality_deg, SENSOR_DEG))
    attitude = float(np.hypot(sigma, UP_DEG))
    return Forward(device.calibration.vehicle_from_sensor, sigma, attitude, device.halves_deg or 0.0)


def _mean(frame: Array, variance: float, device: Array, quality_deg: float) -> tuple[Array, float]:
    """Merge this module's alignment with the firmware's, which has the standard error quality_deg.

    Returns the alignment with the firmware's up and the weighted mean of both forwards, and the variance in deg^2.
    """
    device_variance = quality_deg**2 + SENSOR_DEG**2
    share = variance / (variance + device_variance)
    common = CORRELATION * float(np.sqrt(variance * device_variance))
    difference_deg = float(_yaw_deg(device, frame))
    excess = difference_deg**2 / (variance + device_variance - 2.0 * common) / APART_SIGMAS**2
    mean = (1.0 - share) ** 2 * variance + share**2 * device_variance + 2.0 * share * (1.0 - share) * common
    return frame_of(device[1], (1.0 - share) * frame[2] + share * device[2]), mean * max(1.0, excess)


def _yaw_deg(frames: Array, reference: Array) -> Array:
    return np.degrees(rotation_vector(frames @ reference.T)[..., 1])
