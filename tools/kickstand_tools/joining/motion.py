"""The motion of a ride from the sensor alone, and its fit to a track. The sensor may be mounted at any angle.

Up is the mean direction of the force in bends, because a motorcycle leans until the force points along its own up. The
rate about up is the yaw rate times the cosine of the lean.

The fit begins at a rough shift between the clocks of ride and track. First, the shifts around it are tried. Then least
squares find the shift to hundredths of a second, with the drift, the tilt of the ride's up, and the sensor's forward
axis.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..checks.log import CheckedLog
from ..common.messages import InputError
from ..signals import Array, Bools, binned, moving_mean
from .track import Course, Segments, without_trend

STEP_S = 0.05
_MOST_DPS = 20.0  # a bin with a higher rate gets no more weight when up is computed
_LONGEST_S = 100 * 3600.0  # longest ride; memory limits it
_MOST_SINE = 0.87  # largest sine of the lean; over 60 degrees, the speed or the rate is wrong

AROUND_S = 6.0  # largest distance from the rough shift, including the drift at the ends of the ride
_TRIED_S = 0.1  # step between the tried shifts
_SHIFTS = np.arange(-AROUND_S, AROUND_S + _TRIED_S / 2.0, _TRIED_S)
_DRIFTS = np.arange(-300e-6, 301e-6, 20e-6)
USUAL_DRIFT = 100e-6  # standard deviation of the drift between a hot and a cold crystal (prior)
_USUAL_TILT = 0.05  # standard deviation of the tilt of up by an accelerometer's offset, in rad (prior)
_PRIOR = 1.0 / np.array([np.inf, USUAL_DRIFT, _USUAL_TILT, _USUAL_TILT, np.inf, np.inf, np.inf]) ** 2
_SAME_TRACK_S = 0.05  # least standard deviation of the shift; receivers smooth more in bends than on straights
_FREEDOM = 4.0  # degrees of freedom of Student's distribution, which down-weights errors over two sigma
# A smaller error, divided by its sigma, counts as this. A better receiver does not make the error smaller, because of
# the gyro's scale factor.
_LEAST_ERROR = 0.5
_LEAST_COST = 0.5 * (_FREEDOM + 1.0) * np.log1p(_LEAST_ERROR**2 / _FREEDOM)  # least cost of a step
_ROUNDS = 8
_FEWEST = 2  # least number of segments to compare
_OF_CLOCK = 2  # number of unknowns of the clocks, which come first: shift and drift
_STEPS_ALIKE = 4.0  # number of neighbouring steps that share an error, because courses are smooth


@dataclass
class BinMotion:
    """A ride in n bins of STEP_S from its first sample."""

    force_g: Array  # mean force of each bin along the sensor's axes, shape (n, 3)
    rate_dps: Array  # mean rate of each bin about the sensor's axes, minus the gyro's bias, shape (n, 3)
    valid: Bools  # False in a bin without samples or with frozen readings, whose force and rate are 0, shape (n)
    has_speed: bool
    has_positions: bool

    @property
    def t_s(self) -> Array:
        """The middle of each bin, in s since the first sample, shape (n)."""
        return np.arange(0.5, len(self.valid)) * STEP_S

    @property
    def seconds(self) -> float:
        """Duration of the ride."""
        return len(self.valid) * STEP_S

    @property
    def up(self) -> Array:
        """The bike's up in the sensor's axes, shape (3). It includes the accelerometer's bias, of a few degrees."""
        turning = np.minimum(np.linalg.norm(self.rate_dps, axis=1), _MOST_DPS)
        up: Array = turning @ self.force_g
        return up / max(float(np.linalg.norm(up)), 1e-9)


def motion(ride: CheckedLog) -> BinMotion:
    """Return the BinMotion of a checked log. Raises InputError if all readings are frozen, or for a too long ride."""
    log, measured = ride.log, ride.measured
    if log.t_s[-1] > _LONGEST_S:
        raise InputError(f"{log.name} is longer than {_LONGEST_S / 3600:.0f} hours: cut it first")
    part = log if np.all(measured) else log.part(measured)
    longest = round(_LONGEST_S / STEP_S) + 1
    bins = binned(part.t_s, STEP_S, [*part.accel_g.T, *part.gyro_dps.T], [], longest, longest)
    if bins is None:
        raise InputError(f"{log.name}: all readings are frozen: check the sensor")
    missing = np.zeros((bins.first, 6))  # stays 0 if the readings are frozen from the beginning
    means = np.vstack((missing, bins.means - np.append(np.zeros(3), np.nanmedian(bins.means[:, 3:], axis=0))))
    valid = np.append(missing[:, 0], bins.count) > 0
    means[~valid] = 0.0
    has_speed, has_positions = (bool(np.any(np.isfinite(values))) for values in (log.speed_mps, log.lat_deg))
    return BinMotion(means[:, :3], means[:, 3:], valid, has_speed, has_positions)


class Comparison:
    """Compares a ride with a track. A shift is the track's time at the ride's first sample, in s since its first point.

    given: the segments of the track that are within the ride for every shift within margin_s.
    """

    def __init__(self, motion: BinMotion, course: Course, segments: Segments, shift_s: float, margin_s: float) -> None:
        begin_s, end_s = segments.begin_s[:, 0] - shift_s, segments.end_s[:, -1] - shift_s
        within = (begin_s > margin_s) & (end_s < motion.seconds - margin_s)
        missing = np.append(0, np.cumsum(~motion.valid))
        first, last = (
            np.clip(np.rint(limit_s / STEP_S).astype(int), 0, len(motion.valid)) for limit_s in (begin_s, end_s)
        )
        within &= missing[last] - missing[first] <= 0.05 * (last - first)
        self.given = segments.part(within)
        self.middle_s = float(self.given.middle_s.mean()) if np.any(within) else 0.0
        self._sums = _double_sums(motion, course, shift_s)
        self._edges_s = np.arange(len(motion.valid) + 1) * STEP_S

    def turned(self, shift_s: float, drift: float = 0.0, axes: int = 3) -> Array:
        """Return the ride's rotation about its up and two axes across it, in degrees, to compare with turned_deg."""
        return self._means(range(axes), shift_s, drift, self.given.course_weight)

    def sped_up(self, shift_s: float, drift: float = 0.0) -> Array:
        """Return the integral of the force along the sensor's axes, to compare with Segments.speed_mps."""
        return self._means(range(3, 6), shift_s, drift, self.given.speed_weight)

    def _means(self, columns: range, shift_s: float, drift: float, weight: Array) -> Array:
        track = self.given
        shift = shift_s + drift * (track.middle_s - self.middle_s)
        begin_s, end_s = track.begin_s - shift, track.end_s - shift
        means = []
        for column in columns:
            sums = self._sums[:, column]
            mean = np.interp(end_s, self._edges_s, sums) - np.interp(begin_s, self._edges_s, sums)
            means.append(without_trend(mean / (end_s - begin_s), weight, track.middle_s))
        return np.array(means)


def _double_sums(motion: BinMotion, course: Course, shift_s: float) -> Array:
    """Return six integrals over time, of angles and speeds, shape (n + 1, 6).

    The mean of an angle or a speed between two times is the difference of its integral, divided by the duration.
    Columns 0 to 2 integrate the rotation about up and about two axes across it, in degrees. Columns 3 to 5 integrate
    the speed that the force along the sensor's axes causes, in m/s. The lean of a balanced bike follows from the
    track's speed and the yaw rate.
    """
    up = motion.up
    across = np.asarray(np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))]), dtype=float)
    across /= np.linalg.norm(across)
    rates = motion.rate_dps @ np.vstack((up, across, np.cross(up, across))).T
    yaw_dps = moving_mean(rates[:, 0], round(1.0 / STEP_S))
    middle_s = (course.begin_s + course.end_s) / 2.0
    speed = np.interp(motion.t_s + shift_s, middle_s, np.where(course.good, course.speed_mps, 0.0))
    sine = np.minimum(np.abs(speed * np.radians(yaw_dps)) / STANDARD_GRAVITY, _MOST_SINE)
    cosine = np.asarray(np.sqrt(1.0 - sine * sine), dtype=float)
    angle_deg = _sums(rates / cosine[:, None])
    speed_mps = _sums(motion.force_g * STANDARD_GRAVITY)
    # subtract gravity, whose large sums would cost digits
    speed_mps -= np.linspace(0.0, 1.0, len(speed_mps))[:, None] * speed_mps[-1]
    at_edges = np.hstack((angle_deg, speed_mps))
    return _sums((at_edges[1:] + at_edges[:-1]) / 2.0)


def _sums(values: Array) -> Array:
    """Integrate each column, one row per bin, shape (n, k), from the first edge to each edge, shape (n + 1, k)."""
    return np.vstack((np.zeros(values.shape[1]), np.cumsum(values * STEP_S, axis=0)))


@dataclass
class TrackFit:
    """The best fit of a track to a ride."""

    shift_s: float  # the track's time at the ride's first sample, in s since the track's first point
    drift: float  # seconds per second that the ride's clock loses
    # standard deviation of a track point's time in the ride, for the end of the ride with the larger one
    sigma_s: float
    correlation: float  # correlation of the courses' changes
    # logarithm of the courses' likelihood with the ride's yaw, minus its logarithm without the ride's yaw
    evidence: float
    tilt: Array  # tilt of the ride's up about two axes, in rad, shape (2)
    segments: int  # number of compared segments


def fitted(motion: BinMotion, course: Course, segments: Segments, rough_s: float) -> TrackFit | None:
    """Return the best fit within AROUND_S of a rough shift. None if ride and track hardly overlap at these shifts."""
    compared = Comparison(motion, course, segments, rough_s, AROUND_S + 1.0)
    if len(compared.given.begin_s) < _FEWEST:
        return None
    shift_s, drift, evidence = _try_shifts(compared, rough_s)
    return _refine(Comparison(motion, course, segments, shift_s, 2.0), shift_s, drift, evidence)


def cost_of_one_shift(motion: BinMotion, course: Course, segments: Segments, fit: TrackFit) -> float:
    """Return by how much the cost per segment falls if each has its own shift, in units of an error's mean cost.

    The result is under 2 if the track belongs to the ride, and over 4 for the same road at another time.
    """
    compared = Comparison(motion, course, segments, fit.shift_s, AROUND_S + 1.0)
    track = compared.given
    # From the shift at the ride's first sample to that in the middle of these segments, the inverse of _with_sigma()'s
    shift_s = fit.shift_s * (1.0 - fit.drift) + fit.drift * compared.middle_s
    costs = _costs(compared, shift_s, fit.drift, np.append(1.0, fit.tilt))
    together = float(costs[len(_SHIFTS) // 2].sum())
    usual = max(together / np.count_nonzero(track.course_weight), _LEAST_COST)
    return (together - float(costs.min(axis=0).sum())) / len(track.begin_s) / usual


def _try_shifts(compared: Comparison, rough_s: float) -> tuple[float, float, float]:
    """Return the best of the tried shifts and drifts, and its evidence (see TrackFit)."""
    track, middle_s = compared.given, compared.middle_s
    costs = _costs(compared, rough_s, 0.0, np.ones(1))
    since_s = track.middle_s.mean(axis=1) - middle_s
    best_cost, best_shift_s, best_drift = np.inf, 0.0, 0.0
    for drift in _DRIFTS:
        # With a drift, the shift differs between segments. For each shift in the middle of the ride, interpolate the
        # cost of each segment at its own shift.
        index = np.clip((_SHIFTS[:, None] + drift * since_s + AROUND_S) / _TRIED_S, 0.0, len(_SHIFTS) - 1.001)
        low = index.astype(int)
        column = np.arange(len(since_s))
        cost_at = costs[low, column] * (low + 1 - index) + costs[low + 1, column] * (index - low)
        total = cost_at.sum(axis=1) + 0.5 * (drift / USUAL_DRIFT) ** 2
        if total.min() < best_cost:
            best_cost, best_shift_s, best_drift = float(total.min()), float(_SHIFTS[np.argmin(total)]), float(drift)
    steps = np.count_nonzero(track.course_weight)
    without = float(_cost(track, track.turned_deg).sum())
    evidence = 0.5 * steps / _STEPS_ALIKE * np.log(without / max(best_cost, 1e-9))
    return rough_s + best_shift_s, best_drift, float(evidence)


def _costs(compared: Comparison, shift_s: float, drift: float, along: Array) -> Array:
    """Return the cost of each segment at each of _SHIFTS around a shift, for a rotation about the axes `along`."""
    track = compared.given
    return np.array(
        [
            _cost(track, track.turned_deg - np.tensordot(along, compared.turned(shift_s + by, drift, len(along)), 1))
            for by in _SHIFTS
        ]
    )


def _cost(given: Segments, error_deg: Array) -> Array:
    """Return minus the log-likelihood of each segment's errors, shape (p, STEPS), by Student's distribution."""
    square = error_deg * error_deg * given.course_weight
    return 0.5 * (_FREEDOM + 1.0) * np.log1p(square / _FREEDOM).sum(axis=1)


@dataclass
class _Step:
    """The linearisation at one state of the seven unknowns: shift, drift, tilt (2), the sensor's forward axis (3)."""

    model_deg: Array  # the predicted courses, shape (p, STEPS)
    pulls: Array  # the gradient of each segment's cost, shape (p, 7)
    inverse: Array  # the inverse of the normal matrix, shape (7, 7)


def _refine(compared: Comparison, shift_s: float, drift: float, evidence: float) -> TrackFit:
    track = compared.given
    forward = _least(compared.sped_up(shift_s, drift), track.speed_mps, track.speed_weight)
    unknowns = np.array([shift_s, drift, 0.0, 0.0, *forward])
    step = _step(compared, unknowns)
    for _ in range(_ROUNDS):
        change = step.inverse @ (step.pulls.sum(axis=0) - _PRIOR * unknowns)
        change[0] = np.clip(change[0], -1.0, 1.0)
        unknowns = unknowns + change
        step = _step(compared, unknowns)
    return _with_sigma(compared, evidence, unknowns, step)


def _step(compared: Comparison, unknowns: Array) -> _Step:
    """Linearise courses and speeds at these unknowns, with robust weights."""
    track, (shift_s, drift, *tilt), forward = compared.given, unknowns[:4], unknowns[4:]
    along = np.array([1.0, *tilt])
    turned, sped_up = compared.turned(shift_s, drift), compared.sped_up(shift_s, drift)
    later = compared.turned(shift_s + _TRIED_S, drift) - compared.turned(shift_s - _TRIED_S, drift)
    faster = compared.sped_up(shift_s + _TRIED_S, drift) - compared.sped_up(shift_s - _TRIED_S, drift)
    model_deg = np.tensordot(along, turned, 1)
    course_error, speed_error = track.turned_deg - model_deg, track.speed_mps - np.tensordot(forward, sped_up, 1)
    course_slope, speed_slope = (
        np.tensordot(axes, change, 1) / (2.0 * _TRIED_S) for axes, change in ((along, later), (forward, faster))
    )
    since_s = track.middle_s - compared.middle_s
    zero = np.zeros_like(since_s)
    by_course = np.array([course_slope, course_slope * since_s, turned[1], turned[2], zero, zero, zero])
    by_speed = np.array([speed_slope, speed_slope * since_s, zero, zero, *sped_up])
    course_weights = _robust_weights(course_error, track.course_weight)
    speed_weights = _robust_weights(speed_error, track.speed_weight)
    curvature = np.einsum("ips,jps,ps->ij", by_course, by_course, course_weights)
    curvature += np.einsum("ips,jps,ps->ij", by_speed, by_speed, speed_weights) + np.diag(_PRIOR + 1e-9)
    pulls = np.einsum("ips,ps->pi", by_course, course_weights * course_error)
    pulls += np.einsum("ips,ps->pi", by_speed, speed_weights * speed_error)
    return _Step(model_deg, pulls, np.asarray(np.linalg.inv(curvature), dtype=float))


def _with_sigma(compared: Comparison, evidence: float, unknowns: Array, step: _Step) -> TrackFit:
    """Return the TrackFit with its standard deviation.

    Errors within a segment may be correlated, so the covariance is inverse x spread x inverse (sandwich estimator),
    where the spread is the covariance of the sum of the segments' gradients at the solution. The shift at a time is
    shift + drift x time since the middle, so its variance is that of (1, time) . (shift, drift).
    """
    track, count, drift = compared.given, len(step.pulls), float(unknowns[1])
    spread = step.pulls.T @ step.pulls * count / max(count - _OF_CLOCK, 1) + np.diag(_PRIOR)
    covariance = (step.inverse @ spread @ step.inverse)[:_OF_CLOCK, :_OF_CLOCK]
    ends_s = np.array([track.begin_s.min(), track.end_s.max()]) - compared.middle_s
    at_ends = [np.array([1.0, end_s]) for end_s in ends_s]
    variance = max(float(at_end @ covariance @ at_end) for at_end in at_ends)
    weight = track.course_weight
    size = np.sqrt((weight * track.turned_deg**2).sum() * (weight * step.model_deg**2).sum())
    return TrackFit(
        # The track's time t is t - shift - drift x (t - middle) in the ride. This t is at 0 there
        shift_s=(float(unknowns[0]) - drift * compared.middle_s) / (1.0 - drift),
        drift=drift,
        sigma_s=float(np.hypot(np.sqrt(variance), _SAME_TRACK_S)),
        correlation=float((weight * track.turned_deg * step.model_deg).sum() / max(size, 1e-9)),
        evidence=evidence,
        tilt=unknowns[2:4],
        segments=count,
    )


def _least(columns: Array, values: Array, weight: Array) -> Array:
    """Return the coefficients of k columns, (k, p, STEPS), whose sum fits the values by weighted least squares."""
    root = np.sqrt(weight)
    coefficients = np.linalg.lstsq((columns * root).reshape(len(columns), -1).T, (values * root).ravel(), rcond=None)[0]
    return np.asarray(coefficients, dtype=float)


def _robust_weights(error: Array, weight: Array) -> Array:
    """Return the weight of each error by its variance, reduced for outliers, shape (p, STEPS)."""
    scaled = error * np.sqrt(weight)
    usual = max(float(np.median(np.abs(scaled[weight > 0.0]))) / 0.6745, _LEAST_ERROR)
    return weight / usual**2 * (1.0 + 1.0 / _FREEDOM) / (1.0 + (scaled / usual) ** 2 / _FREEDOM)
