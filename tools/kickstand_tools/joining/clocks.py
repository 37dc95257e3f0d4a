"""Finds the shift and the drift between the clocks of two sensors on one bike.

First, every shift is tried with the magnitude of the rates, which does not depend on the sensors' mounting. Then shift
and drift are fitted by least squares to the rates about A's axes. The rates also give the rotation of B relative to A.
All results are in the time and the axes of sensor A; B is the other sensor.
"""

from dataclasses import dataclass

import numpy as np

from ..calibration.file import CalibrationFile
from ..common.messages import InputError
from ..signals import Array, Bools, correlations, log_likelihood_ratio, moving_mean, peaks, rotation_angle
from .fit import USUAL_DRIFT
from .match import LEAST_EVIDENCE, LEAST_LEAD, LEAST_S, MOST_DRIFT
from .motion import STEP_S, BinMotion

_SMOOTH = 5  # rates are averaged over this many bins, to find their derivatives
_MOST_DPS = 60.0  # higher rates are due to jolts, and are limited to this
_APART_S, _CANDIDATES = 3.0, 6
_INDEPENDENT_S = 1.0  # rates that are further apart in time are treated as independent
_LEAST_CORRELATION = 0.8  # least correlation of the rates: two sensors on one bike have a correlation over 0.9
_MOST_APART_DEG = 15.0  # largest contradiction between the calibrations, which are exact to a few degrees
_ROUNDS = 8


@dataclass
class Clocks:
    """The relation of the clocks of sensors A and B.

    later_s: time of B's first sample minus the time of A's first sample, in s.
    drift: seconds per second that B's clock loses against A's.
    correlation: correlation of the rates.
    common_s: time for which both have samples, without gaps and frozen readings, in s.
    apart_deg: angle between two results for B's rotation relative to A: from the calibrations, and from the gyros.
    """

    later_s: float
    drift: float
    correlation: float
    common_s: float
    apart_deg: float = 0.0

    def of_b(self, a_s: Array) -> Array:
        """Convert seconds since A's first sample to seconds since B's first sample."""
        return (a_s - self.later_s) * (1.0 - self.drift)


def clocks(a: BinMotion, b: BinMotion, axes_a: CalibrationFile, axes_b: CalibrationFile) -> Clocks:
    """The Clocks of two recordings. Raises InputError if they are from different rides, or if the ride cannot be proved
    to be the same. Callers put both names in front of the error's text."""
    size = [_size(motion) for motion in (a, b)]
    correlation, count = correlations(size[0], a.valid, size[1], b.valid)
    correlation = np.where(count * STEP_S >= LEAST_S, correlation, 0.0)
    likely = log_likelihood_ratio(correlation, count, STEP_S / _INDEPENDENT_S)
    candidates = peaks(likely, round(_APART_S / STEP_S), _CANDIDATES)
    tried = []
    for index in candidates:
        shift_s = (index - (len(b.valid) - 1)) * STEP_S
        alike = _correlation_at(a, b, _along(a, np.eye(3)), _along(b, _rotation(a, b, shift_s)), shift_s)
        ratio = log_likelihood_ratio(np.array(alike), count[index], STEP_S / _INDEPENDENT_S)
        tried.append((float(ratio), alike, shift_s))
    tried.sort(reverse=True)
    if not tried or tried[0][0] < LEAST_EVIDENCE or tried[0][1] < _LEAST_CORRELATION:
        raise InputError("at no time do they turn alike for a minute: are they of one ride, and both on the bike?")
    if len(tried) > 1 and tried[1][0] > tried[0][0] - LEAST_LEAD:
        raise InputError("they fit at two times: a longer ride with more bends is needed")
    turn = _rotation(a, b, tried[0][2])
    relation = _fitted(a, b, _along(a, np.eye(3)), _along(b, turn), tried[0][2])
    # B's axes relative to A's, once from the rates and once from both calibrations
    turn = _rotation(a, b, relation.later_s)
    rotation = np.asarray(axes_a.vehicle_from_sensor).T @ np.asarray(axes_b.vehicle_from_sensor)
    apart = float(np.degrees(rotation_angle(rotation @ turn.T)))
    if apart > _MOST_APART_DEG:
        raise InputError(
            f"they turn alike, but by their calibrations about axes that are {apart:.0f} degrees apart: is one of "
            "another mount?"
        )
    relation.apart_deg = apart
    return relation


def _size(motion: BinMotion) -> Array:
    """Return the magnitude of the rates minus its mean, in deg/s, shape (n)."""
    size = moving_mean(np.minimum(np.linalg.norm(motion.rate_dps, axis=1), _MOST_DPS), _SMOOTH)
    return size - np.mean(size[motion.valid])


def _along(motion: BinMotion, axes: Array) -> Array:
    """Return the smoothed rates about the rows of axes (3, 3), shape (n, 3)."""
    return moving_mean(np.clip(motion.rate_dps @ axes.T, -_MOST_DPS, _MOST_DPS), _SMOOTH)


def _rotation(a: BinMotion, b: BinMotion, later_s: float) -> Array:
    """Return the rotation from B's axes to A's, shape (3, 3), that brings B's rates nearest to A's (Kabsch's
    algorithm)."""
    valid = _valid_at(b, a.t_s - later_s) & a.valid
    rates_a, rates_b = (
        _along(a, np.eye(3))[valid],
        _interpolated_at(b.t_s, _along(b, np.eye(3)), a.t_s[valid] - later_s),
    )
    left, _, right = np.linalg.svd((rates_a - rates_a.mean(axis=0)).T @ (rates_b - rates_b.mean(axis=0)))
    return left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def _fitted(a: BinMotion, b: BinMotion, of_a: Array, of_b: Array, later_s: float) -> Clocks:
    """The Clocks, found by Gauss-Newton steps from a rough shift."""
    at_s, drift = a.t_s, 0.0
    derivative = np.gradient(of_b, STEP_S, axis=0)
    error = np.zeros(0)
    for k in range(_ROUNDS):
        on_b = (at_s - later_s) * (1.0 - drift)
        valid = _valid_at(b, on_b) & a.valid
        if np.count_nonzero(valid) * STEP_S < LEAST_S:
            raise InputError(f"they have less than {LEAST_S:.0f} s of riding in common")
        since_s = at_s[valid] - at_s[valid].mean()
        model, changes = (_interpolated_at(b.t_s, values, on_b[valid]) for values in (of_b, derivative))
        error = of_a[valid] - model
        weight = 1.0 / (1.0 + np.sum(error**2, axis=1) / (4.0 * np.median(np.sum(error**2, axis=1)) + 1e-9))
        by_shift = -changes
        by_drift = -changes * since_s[:, None]
        normal = np.array([[_dot(p, q, weight) for q in (by_shift, by_drift)] for p in (by_shift, by_drift)])
        gradient = np.array([_dot(p, error, weight) for p in (by_shift, by_drift)])
        normal[1, 1] += float(np.mean(weight @ error**2)) / len(error) / USUAL_DRIFT**2
        step = np.linalg.solve(normal, gradient) if k > 0 else np.array([gradient[0] / max(normal[0, 0], 1e-9), 0.0])
        step[0] = np.clip(step[0], -0.5, 0.5)
        # The step changes the shift in the middle of the compared part. From this change, compute the shift at the
        # start
        drift, middle = drift + step[1], at_s[valid].mean()
        later_s += step[0] - step[1] * (middle - later_s)
    if abs(drift) > MOST_DRIFT:
        raise InputError("they turn alike, but their clocks drift apart by more than clocks do: one has gaps")
    common_s = float(np.count_nonzero(_valid_at(b, (at_s - later_s) * (1.0 - drift)) & a.valid) * STEP_S)
    return Clocks(float(later_s), float(drift), _correlation_at(a, b, of_a, of_b, later_s, drift), common_s)


def _correlation_at(a: BinMotion, b: BinMotion, of_a: Array, of_b: Array, later_s: float, drift: float = 0.0) -> float:
    """The correlation of the rates of both sensors about the same axes. of_a: shape (n, 3). of_b: shape (m, 3)."""
    on_b = (a.t_s - later_s) * (1.0 - drift)
    valid = _valid_at(b, on_b) & a.valid
    rates_a, rates_b = of_a[valid], _interpolated_at(b.t_s, of_b, on_b[valid])
    rates_a, rates_b = rates_a - rates_a.mean(axis=0), rates_b - rates_b.mean(axis=0)
    return float(np.sum(rates_a * rates_b) / max(np.sqrt(np.sum(rates_a**2) * np.sum(rates_b**2)), 1e-9))


def _valid_at(motion: BinMotion, at_s: Array) -> Bools:
    number = np.rint(at_s / STEP_S - 0.5).astype(np.int64)
    inside = (number >= 0) & (number < len(motion.valid))
    return inside & motion.valid[np.clip(number, 0, len(motion.valid) - 1)]


def _interpolated_at(t_s: Array, values: Array, at_s: Array) -> Array:
    return np.column_stack([np.interp(at_s, t_s, column) for column in values.T])


def _dot(p: Array, q: Array, weight: Array) -> float:
    return float(weight @ np.sum(p * q, axis=1))
