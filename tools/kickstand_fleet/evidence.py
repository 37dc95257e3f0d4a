"""The normal equations of a drive for the sensor's alignment, in blocks of some seconds that can be compared.

As in the firmware's ForwardRegression, a regression explains the force of each interval between two speeds by

    f = level + forward a + left c + arm w        a = dv/dt / g, c = v (yaw rate) / g, w = d(yaw rate)/dt

in the sensor's own axes. Unlike the firmware, it also uses bends: in a car they show left as well as braking shows
forward. A sensor ahead of the rear axle is accelerated sideways when a bend begins and ends. Drivers brake and speed up
at the same moments. The coefficient arm, the sensor's distance from that axle, absorbs this. A motorcycle leans into
bends: its force stays along its own up and grows to sqrt(1 + c^2). So for a motorcycle

    f = level sqrt(1 + c^2) + forward a

A car's body also sways on its springs, mostly sideways. The direction depends on the vehicle but does not change: if it
changes in the sensor's axes, the mount has moved.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain

import numpy as np
from kickstand.drive_alignment.alignment import MOTORCYCLE
from kickstand.drive_alignment.events import MAX_INTERVAL_US
from kickstand.units import GAP_US, STANDARD_GRAVITY
from kickstand_tools.logs.log import Log, Table
from kickstand_tools.signals import STANDING_MPS, Array, moving_mean, runs

INTERVAL_S = 0.9  # least time between two speeds that are used
MOVING_MPS = 2.0
STANDING_WEIGHT = 0.3  # weight of a second at a stop: a long stop shows only one slope of the road, like a short one
LEVEL_S = 20.0  # over this time the mean force is about vertical: the rate about it is the yaw rate
BLOCK_S = 8.0
# The road: ratio of the variance of its slope to that of all other errors in a mean over 1 s, and its correlation
# length
ROAD_SHARE, ROAD_M = 1.0, 150.0
SWING_S = 0.2  # the yaw rate at both ends of an interval is averaged over this
SWAY_S = 0.05, 0.3  # sway is the mean force over the first minus that over the second: it excludes noise and driving
# deg/s: at this yaw rate an interval of a car counts half. In a tight turn a sensor ahead of the rear axle moves in a
# direction that differs from the vehicle's heading by its distance from that axle over the turn's radius.
TIGHT_DPS = 20.0


@dataclass
class Intervals:
    """n intervals between two speeds of a log. t_s: their middles. force (n, 3, g): means, in the sensor's axes.
    terms (n, 4): the regressors of level, forward, left and arm. weight (n): s. speed (n): m/s. sway (n, 3, 3, g^2):
    the covariance of the force's quick changes; zeros where it is not used."""

    t_s: Array
    force: Array
    terms: Array
    weight: Array
    speed: Array
    sway: Array


@dataclass
class Blocks(Table):
    """Consecutive blocks (m) of intervals in one or several logs.

    square (m, 4, 4), product (m, 4, 3): sums of terms x terms and of terms x force, the road's slope filtered out (see
    _without_road()). sway (m, 3, 3): mean of the intervals' sway, divided by its trace, because a rough road must not
    count more than a smooth one. log (m): index of the log; t_s, end_s (m): begin and end in it.
    """

    square: Array
    product: Array
    sway: Array
    log: Array
    t_s: Array
    end_s: Array


def intervals(log: Log, kind: str, lag_s: float, bias_dps: Array) -> Intervals:
    """The intervals of a log whose speed is delayed by lag_s. bias_dps (3): the gyro's bias."""
    step = np.diff(log.t_s, prepend=log.t_s[0])
    step = np.where(step * 1e6 > GAP_US, 0.0, step)
    rate = np.radians(log.gyro_dps - bias_dps)
    there = np.flatnonzero(~np.isnan(log.speed_mps))
    time, speed = log.t_s[there] - lag_s, log.speed_mps[there]
    kept = time >= 0.0
    time, speed = _thinned(time[kept], speed[kept])
    curve = rate * (np.interp(log.t_s, time, speed) / STANDARD_GRAVITY)[:, None]
    sway = _sway(log)
    squares = (one * other for one in sway.T for other in sway.T)
    ends = _integrals(chain(log.accel_g.T, curve.T, squares), log.t_s, step, time)
    seconds, whole = np.diff(time), np.diff(np.interp(time, log.t_s, np.cumsum(step)))
    good = (seconds <= MAX_INTERVAL_US * 1e-6) & (whole > 0.9 * seconds)
    means = (np.diff(ends, axis=0) / np.maximum(whole, 1e-9)[:, None])[good]
    middle, length = (time[1:] - seconds / 2.0)[good], seconds[good]
    mean_mps = (0.5 * (speed[1:] + speed[:-1]))[good]
    a = (np.diff(speed) / seconds / STANDARD_GRAVITY)[good]
    up = _local_up(middle, means[:, :3], length)
    c = np.sum(means[:, 3:6] * up, axis=1)
    standing = (mean_mps < STANDING_MPS) & (np.abs(a) < 0.01)
    if kind == MOTORCYCLE:
        terms = np.column_stack((np.sqrt(1.0 + c * c), a, np.zeros_like(a), np.zeros_like(a)))
        weight = length * (mean_mps > MOVING_MPS)  # at lower speeds a foot is down
        shown = np.zeros_like(a)  # not used for a motorcycle, which sways about its tyre contacts and with its rider
    else:
        later, sooner = (_integrals(rate.T, log.t_s, step, time + ahead) for ahead in (SWING_S / 2.0, -SWING_S / 2.0))
        swing = (later - sooner) / SWING_S
        w = np.sum(np.diff(swing, axis=0)[good] * up, axis=1) / length
        terms = np.column_stack((np.ones_like(a), a, c, w))
        weight = length * np.where(standing, STANDING_WEIGHT, mean_mps > STANDING_MPS)
        turning_dps = np.degrees(c * STANDARD_GRAVITY / np.maximum(mean_mps, MOVING_MPS))
        weight /= 1.0 + (turning_dps / TIGHT_DPS) ** 2
        shown = (mean_mps > MOVING_MPS).astype(float)
    sway = (means[:, 6:] * shown[:, None]).reshape(-1, 3, 3)
    return Intervals(middle, means[:, :3], terms, weight, mean_mps, sway)


def blocks(logs: list[Intervals]) -> Blocks:
    """All intervals of the logs in blocks of about BLOCK_S."""
    square, product, sway, which, begin, end = [], [], [], [], [], []
    for index, log in enumerate(logs):
        if not len(log.t_s):
            continue
        starts = runs(np.floor((log.t_s - log.t_s[0]) / BLOCK_S))
        terms, force = _without_road(log)
        square.append(np.add.reduceat(terms[:, :, None] * terms[:, None, :], starts))
        product.append(np.add.reduceat(terms[:, :, None] * force[:, None, :], starts))
        swayed = np.add.reduceat(log.sway, starts)
        sway.append(swayed / np.maximum(np.trace(swayed, axis1=1, axis2=2), 1e-12)[:, None, None])
        which.append(np.full(len(starts), index))
        begin.append(log.t_s[starts])
        end.append(log.t_s[np.append(starts[1:], len(log.t_s)) - 1])
    if not square:
        none = np.zeros(0)
        return Blocks(np.zeros((0, 4, 4)), np.zeros((0, 4, 3)), np.zeros((0, 3, 3)), np.zeros(0, int), none, none)
    return Blocks(*(np.concatenate(parts) for parts in (square, product, sway, which, begin, end)))


def fits(square: Array, product: Array) -> tuple[Array, Array]:
    """Solve k normal equations of t terms. Return two arrays.

    (k, t, 3): the coefficients, which are level, forward, left and, if t is 4, arm. (k, 2): how much the regressors a
    and c of the module's docstring varied, g^2 s.
    """
    ridge = np.diag([1e-9] + [1e-6] * (square.shape[-1] - 1)) * np.maximum(square[..., :1, :1], 1e-3)
    found = np.asarray(np.linalg.solve(square + ridge, product), dtype=float)
    seconds = np.maximum(square[..., 0, 0], 1e-9)[..., None]
    means = square[..., 0, 1:3] / seconds
    varied = np.diagonal(square, axis1=-2, axis2=-1)[..., 1:3] - seconds * means * means
    return found, varied


def frames(found: Array, varied: Array) -> Array:
    """(k, 3, 3) vehicle from sensor, rows left, up, forward, from the two results of fits()."""
    level, forward, left = found[..., 0, :], found[..., 1, :], found[..., 2, :]
    up = level / np.maximum(np.linalg.norm(level, axis=-1, keepdims=True), 1e-9)
    ahead = varied[..., :1] * forward + varied[..., 1:] * np.cross(left, up)
    return frame_of(up, np.asarray(ahead, dtype=float))


def frame_of(up: Array, ahead: Array) -> Array:
    """(..., 3, 3) rows left, up, forward, from up (..., 3, unit vectors) and vectors roughly forward (..., 3)."""
    side = np.cross(up, ahead)
    side /= np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-9)
    return np.asarray(np.stack((side, up, np.cross(side, up)), axis=-2), dtype=float)


def handedness(found: Array, varied: Array) -> float:
    """The lateral force in bends divided by the force that the yaw rate requires. The ratio is about 1, or about -1 if
    the gyro's signs or the axes are mirrored. It is 0 without bends, and on a motorcycle, which leans into them."""
    if varied[1] < 0.05:
        return 0.0
    level, forward, left = found[:3]
    side = np.cross(level, forward)
    return float(side @ left / max(float(np.linalg.norm(side)), 1e-9))


def _without_road(log: Intervals) -> tuple[Array, Array]:
    """Terms and force, whitened: each minus its prediction from the earlier intervals, divided by its standard
    deviation.

    Slope and camber of the road look like another level for some hundred metres. Neighbouring intervals share these
    errors, and a plain regression would treat the road's slope during braking as forward. The innovations of a filter
    that follows the road (a first-order Gauss-Markov process in distance) are uncorrelated: their sums are those of
    generalized least squares.
    """
    rows = np.hstack((log.terms, log.force))
    driven = log.speed * np.diff(log.t_s, prepend=log.t_s[0])
    kept = np.exp(-driven / ROAD_M)
    predicted, variance = np.zeros(rows.shape[1]), ROAD_SHARE
    for k, weight in enumerate(log.weight.tolist()):
        predicted = predicted * kept[k]
        variance = ROAD_SHARE + (variance - ROAD_SHARE) * kept[k] ** 2
        gain = variance * weight / (variance * weight + 1.0)
        rows[k] -= predicted
        predicted = predicted + gain * rows[k]
        rows[k] *= math.sqrt(weight * (1.0 - gain))
        variance *= 1.0 - gain
    return rows[:, :-3], rows[:, -3:]


def sway_deg(sway: Array, frame: Array) -> Array:
    """(k) the direction of the largest sway, degrees from forward towards left, -90 to 90. sway (k, 3, 3), frame (3,
    3)."""
    level = frame[[0, 2]] @ sway @ frame[[0, 2]].T
    return np.degrees(0.5 * np.arctan2(2.0 * level[..., 0, 1], level[..., 1, 1] - level[..., 0, 0]))


def _sway(log: Log) -> Array:
    """(samples, 3) the changes of force that take some tenths of a second, g."""
    step_s = float(np.median(np.diff(log.t_s)))
    quick, slow = (moving_mean(log.accel_g, round(width_s / step_s)) for width_s in SWAY_S)
    return quick - slow


def _integrals(columns: Iterable[Array], t_s: Array, step: Array, time: Array) -> Array:
    """(len(time), k): the integral of each of k columns (n) until these times. Column by column, to limit memory."""
    return np.array([np.interp(time, t_s, np.cumsum(column * step)) for column in columns]).T


def _thinned(time: Array, speed: Array) -> tuple[Array, Array]:
    """The speeds, thinned to at most one per INTERVAL_S."""
    kept, last = [], -np.inf
    for k, now in enumerate(time.tolist()):
        if now - last >= INTERVAL_S:
            kept.append(k)
            last = now
    return time[kept], speed[kept]


def _local_up(middle: Array, force: Array, length: Array) -> Array:
    """(n, 3) unit vectors: the mean force of the LEVEL_S around each interval."""
    sums = np.vstack((np.zeros(3), np.cumsum(force * length[:, None], axis=0)))
    first = np.searchsorted(middle, middle - LEVEL_S / 2.0)
    last = np.searchsorted(middle, middle + LEVEL_S / 2.0, side="right")
    up = sums[last] - sums[first]
    return up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-9)
