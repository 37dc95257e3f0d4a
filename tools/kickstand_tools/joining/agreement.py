"""Compares the leans of two devices on one bike, to test a lean meter without a reference.

The comparison does not show errors that both devices share, such as errors of the bike's model. It shows the errors
that each device has alone: of its sensor, its mount and its calibration. If both devices are equally good, each
device's error is the difference divided by the square root of two.

First, clocks() finds the shift and the drift between the clocks. Every shift is tried with the magnitude of the rates,
which does not depend on the sensors' mounting. Then shift and drift are fitted by least squares to the rates about A's
axes. The rates also give the rotation of B relative to A.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..calibration.file import CalibrationFile
from ..calibration.mount import read_ride
from ..common.installation import extra
from ..common.markup import clock, tick_s
from ..common.messages import InputError, Message, as_data
from ..estimation.smooth import SmoothedRide, smooth_checked
from ..logs.log import Source
from ..logs.source import Progress, name_of
from ..replay.replay import LeanTable, replay_checked
from ..signals import Array, Bools, correlations, log_likelihood_ratio, moving_mean, peaks, rotation_angle
from .joined import LEAST_EVIDENCE, LEAST_LEAD, LEAST_S, MOST_DRIFT
from .motion import STEP_S, USUAL_DRIFT, BinMotion, motion

_SMOOTH = 5  # rates are averaged over this many bins, to find their derivatives
_MOST_DPS = 60.0  # higher rates are due to jolts, and are limited to this
_APART_S, _CANDIDATES = 3.0, 6
_INDEPENDENT_S = 1.0  # rates that are further apart in time are treated as independent
_LEAST_CORRELATION = 0.8  # least correlation of the rates: two sensors on one bike have a correlation over 0.9
_MOST_APART_DEG = 15.0  # largest contradiction between the calibrations, which are exact to a few degrees
_ROUNDS = 8

GRID_S = 0.02
_RIDING_MPS = 3.0
_GAP_S = 0.2  # the lean is unknown between samples that are further apart
_LEAST_S = 20.0  # least time of riding to compare
_LEANED_DEG = 3.0  # delay and slope are computed only for a larger rms of the lean


@dataclass
class Clocks:
    """The relation of the clocks of sensors A and B."""

    later_s: float  # time of B's first sample minus the time of A's first sample, in s
    drift: float  # seconds per second that B's clock loses against A's
    correlation: float  # correlation of the rates
    common_s: float  # time for which both have samples, without gaps and frozen readings, in s
    # angle between two results for B's rotation relative to A: from the calibrations, and from the gyros
    apart_deg: float = 0.0

    def of_b(self, a_s: Array) -> Array:
        """Convert seconds since A's first sample to seconds since B's first sample."""
        return (a_s - self.later_s) * (1.0 - self.drift)


def clocks(a: BinMotion, b: BinMotion, axes_a: CalibrationFile, axes_b: CalibrationFile) -> Clocks:
    """Return the Clocks of two recordings. Callers put both names in front of the text of an InputError."""
    shift_s = _rough_shift_s(a, b)
    relation = _fitted(a, b, _along(a, np.eye(3)), _along(b, _rotation(a, b, shift_s)), shift_s)
    # B's axes relative to A's, once from the rates and once from both calibrations
    by_rates = _rotation(a, b, relation.later_s)
    by_calibrations = np.asarray(axes_a.vehicle_from_sensor).T @ np.asarray(axes_b.vehicle_from_sensor)
    apart = float(np.degrees(rotation_angle(by_calibrations @ by_rates.T)))
    if apart > _MOST_APART_DEG:
        raise InputError(
            f"they turn alike, but by their calibrations about axes that are {apart:.0f} degrees apart: is one of "
            "another mount?"
        )
    relation.apart_deg = apart
    return relation


def _rough_shift_s(a: BinMotion, b: BinMotion) -> float:
    """Return the time on A's clock at which B begins, to a bin. Raises InputError without a clear match."""
    correlation, count = correlations(_magnitude(a), a.valid, _magnitude(b), b.valid)
    correlation = np.where(count * STEP_S >= LEAST_S, correlation, 0.0)
    likely = log_likelihood_ratio(correlation, count, STEP_S / _INDEPENDENT_S)
    tried = []
    for index in peaks(likely, round(_APART_S / STEP_S), _CANDIDATES):
        shift_s = (index - (len(b.valid) - 1)) * STEP_S  # see correlations()
        alike = _correlation_at(a, b, _along(a, np.eye(3)), _along(b, _rotation(a, b, shift_s)), shift_s)
        evidence = float(log_likelihood_ratio(np.array(alike), count[index], STEP_S / _INDEPENDENT_S))
        tried.append((evidence, alike, shift_s))
    (evidence, alike, shift_s), *others = sorted(tried, reverse=True) or [(0.0, 0.0, 0.0)]
    if evidence < LEAST_EVIDENCE or alike < _LEAST_CORRELATION:
        raise InputError("at no time do they turn alike for a minute: are they of one ride, and both on the bike?")
    if any(other > evidence - LEAST_LEAD for other, *_ in others):
        raise InputError("they fit at two times: a longer ride with more bends is needed")
    return shift_s


def _magnitude(motion: BinMotion) -> Array:
    """Return the magnitude of the rates minus its mean, in deg/s, shape (n)."""
    magnitude = moving_mean(np.minimum(np.linalg.norm(motion.rate_dps, axis=1), _MOST_DPS), _SMOOTH)
    return magnitude - np.mean(magnitude[motion.valid])


def _along(motion: BinMotion, axes: Array) -> Array:
    """Return the smoothed rates about the rows of axes (3, 3), shape (n, 3)."""
    return moving_mean(np.clip(motion.rate_dps @ axes.T, -_MOST_DPS, _MOST_DPS), _SMOOTH)


def _rotation(a: BinMotion, b: BinMotion, later_s: float) -> Array:
    """Return the rotation from B's axes to A's that brings B's rates nearest to A's (Kabsch's algorithm)."""
    valid, on_b = _common(a, b, later_s)
    rates_a, rates_b = _along(a, np.eye(3))[valid], _interpolated_at(b.t_s, _along(b, np.eye(3)), on_b)
    left, _, right = np.linalg.svd((rates_a - rates_a.mean(axis=0)).T @ (rates_b - rates_b.mean(axis=0)))
    return left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right


def _fitted(a: BinMotion, b: BinMotion, of_a: Array, of_b: Array, later_s: float) -> Clocks:
    """Find the Clocks by Gauss-Newton steps from a rough shift. of_a, of_b: see _correlation_at()."""
    at_s, drift = a.t_s, 0.0
    derivative = np.gradient(of_b, STEP_S, axis=0)
    error = np.zeros(0)
    for k in range(_ROUNDS):
        valid, on_b = _common(a, b, later_s, drift)
        if np.count_nonzero(valid) * STEP_S < LEAST_S:
            raise InputError(f"they have less than {LEAST_S:.0f} s of riding in common")
        since_s = at_s[valid] - at_s[valid].mean()
        model, changes = (_interpolated_at(b.t_s, values, on_b) for values in (of_b, derivative))
        error = of_a[valid] - model
        weight = 1.0 / (1.0 + np.sum(error**2, axis=1) / (4.0 * np.median(np.sum(error**2, axis=1)) + 1e-9))
        derivatives = -changes, -changes * since_s[:, None]  # by the shift and by the drift
        normal = np.array([[_dot(first, second, weight) for second in derivatives] for first in derivatives])
        gradient = np.array([_dot(derivative, error, weight) for derivative in derivatives])
        # Limit the step of the drift: the variance of the errors, divided by that of usual drifts
        normal[1, 1] += float(np.mean(weight @ error**2)) / len(error) / USUAL_DRIFT**2
        step = np.linalg.solve(normal, gradient) if k > 0 else np.array([gradient[0] / max(normal[0, 0], 1e-9), 0.0])
        step[0] = np.clip(step[0], -0.5, 0.5)
        # The step changes the shift in the middle of the compared part. From this change, compute the shift at the
        # start
        drift, middle = drift + step[1], at_s[valid].mean()
        later_s += step[0] - step[1] * (middle - later_s)
    if abs(drift) > MOST_DRIFT:
        raise InputError("they turn alike, but their clocks drift apart by more than clocks do: one has gaps")
    common_s = len(_common(a, b, later_s, drift)[1]) * STEP_S
    return Clocks(float(later_s), float(drift), _correlation_at(a, b, of_a, of_b, later_s, drift), common_s)


def _correlation_at(a: BinMotion, b: BinMotion, of_a: Array, of_b: Array, later_s: float, drift: float = 0.0) -> float:
    """Return the correlation of the rates of both sensors about the same axes, of shapes (n, 3) and (m, 3)."""
    valid, on_b = _common(a, b, later_s, drift)
    rates_a, rates_b = of_a[valid], _interpolated_at(b.t_s, of_b, on_b)
    rates_a, rates_b = rates_a - rates_a.mean(axis=0), rates_b - rates_b.mean(axis=0)
    return float(np.sum(rates_a * rates_b) / max(np.sqrt(np.sum(rates_a**2) * np.sum(rates_b**2)), 1e-9))


def _common(a: BinMotion, b: BinMotion, later_s: float, drift: float = 0.0) -> tuple[Bools, Array]:
    """Return True for A's bins in which B has readings, too, shape (n), and their times on B's clock."""
    on_b = (a.t_s - later_s) * (1.0 - drift)
    number = np.rint(on_b / STEP_S - 0.5).astype(np.int64)
    inside = (number >= 0) & (number < len(b.valid))
    valid = inside & b.valid[np.clip(number, 0, len(b.valid) - 1)] & a.valid
    return valid, on_b[valid]


def _interpolated_at(t_s: Array, values: Array, at_s: Array) -> Array:
    return np.column_stack([np.interp(at_s, t_s, column) for column in values.T])


def _dot(p: Array, q: Array, weight: Array) -> float:
    return float(weight @ np.sum(p * q, axis=1))


@dataclass
class Difference:
    """B's lean minus A's lean, in degrees."""

    seconds: float  # time of riding that is compared
    rms_deg: float  # rms of the difference
    constant_deg: float  # mean of the difference, caused by poses and mounts
    moving_deg: float  # rms of the difference without its mean
    p95_deg: float  # 95 % of the absolute differences without the mean are below this value
    worst_deg: float  # the largest absolute difference without the mean
    slope: float | None  # B's lean divided by A's lean, None if the ride leans too little
    delay_s: float | None  # delay of B's lean in s, None if the ride leans too little
    expected_deg: float  # the rms predicted by both standard deviations
    within_1: float  # share of the differences within one standard deviation
    within_2: float  # share of the differences within two standard deviations


@dataclass
class Agreement:
    """The agreement of rides A and B."""

    clocks: Clocks
    live: Difference | None  # of the displayed leans while both devices show a lean; None without such a time
    smoothed: Difference  # of the smoothed leans
    t_s: Array  # seconds since A's first sample, shape (n)
    leans: dict[str, Array]  # the leans at these times in degrees, shape (n), NaN if unknown
    notices: dict[str, list[Message]] = field(default_factory=dict)
    names: tuple[str, str] = ("", "")  # the names of A's and B's logs

    def as_data(self) -> dict[str, Any]:
        """Return all fields except the leans, for JSON."""
        live = None if self.live is None else asdict(self.live)
        remarks = {name: as_data(notices) for name, notices in self.notices.items()}
        return {"clocks": asdict(self.clocks), "live": live, "smoothed": asdict(self.smoothed), "remarks": remarks}


def compare_rides(
    a: Source,
    b: Source,
    calibration_a: CalibrationFile,
    calibration_b: CalibrationFile,
    progress: Progress | None = None,
) -> Agreement:
    """Compare two recordings of one ride by two devices. The clocks of the devices may differ by any time.

    Raises InputError, also if the recordings are of different rides.

    >>> made = simulate_ride("street", seed=1, seconds=90.0)
    >>> axes, log = made.vehicle_from_sensor, Log.from_readings(made.readings, made.rate_hz)
    >>> calibration = CalibrationFile(vehicle_from_sensor=axes, aligned=True)
    >>> compare_rides(log, log, calibration, calibration).smoothed.rms_deg
    0.0
    """
    checked_a, checked_b = read_ride(a, calibration_a), read_ride(b, calibration_b)
    try:
        relation = clocks(motion(checked_a), motion(checked_b), calibration_a, calibration_b)
    except InputError as error:
        raise InputError(f"{name_of(a)}, {name_of(b)}: {error}") from error
    ride_a = smooth_checked(checked_a, calibration_a, progress)
    ride_b = smooth_checked(checked_b, calibration_b, progress)
    t_s = np.arange(0.0, ride_a.t_s[-1], GRID_S)
    on_b_s = relation.of_b(t_s)
    speeds = (_at_times(ride.t_s, ride.speed_mps, time_s) for ride, time_s in ((ride_a, t_s), (ride_b, on_b_s)))
    riding = np.all([speed_mps > _RIDING_MPS for speed_mps in speeds], axis=0)  # False for NaN
    smoothed = _lean_while_riding(ride_a, t_s, riding), _lean_while_riding(ride_b, on_b_s, riding)
    live_a, live_b = replay_checked(checked_a, calibration_a), replay_checked(checked_b, calibration_b)
    live = _lean_while_riding(live_a, t_s, riding), _lean_while_riding(live_b, on_b_s, riding)
    difference = _difference(*smoothed)
    if difference is None:
        raise InputError(f"{name_of(a)}, {name_of(b)}: under {_LEAST_S:.0f} s of riding in common")
    names = ("live A", "live B", "smoothed A", "smoothed B")
    leans: dict[str, Array] = dict(zip(names, (lean for lean, _ in (*live, *smoothed))))
    notices = {"a": ride_a.notices, "b": ride_b.notices}
    return Agreement(relation, _difference(*live), difference, t_s, leans, notices, (name_of(a), name_of(b)))


def words(found: Agreement) -> Iterator[str]:
    """Yield the lines of the comparison for the user."""
    of = found.clocks
    side = "after" if of.later_s >= 0.0 else "before"
    yield (
        f"B begins {abs(of.later_s):.2f} s {side} A; they have {of.common_s / 60.0:.1f} minutes in common (correlation "
        f"of the rates {of.correlation:.2f}, B's clock {abs(of.drift) * 1e6:.0f} ppm "
        f"{'slow' if of.drift > 0.0 else 'fast'})"
    )
    for name, part in (("live", found.live), ("smoothed", found.smoothed)):
        if part is None:
            yield f"{name}: hardly anywhere is a lean shown by both"
            continue
        yield (
            f"{name}: they differ by {part.rms_deg:.2f} degrees rms over {part.seconds / 60.0:.1f} minutes of riding: "
            f"B leans {abs(part.constant_deg):.2f} more to the {'right' if part.constant_deg > 0.0 else 'left'} all "
            f"the time, and the rest moves by {part.moving_deg:.2f} rms (95 % under {part.p95_deg:.1f}, worst "
            f"{part.worst_deg:.1f})"
        )
        if part.slope is not None and part.delay_s is not None:
            yield (
                f"    B's lean is {part.slope:.3f} times A's, and {abs(part.delay_s) * 1e3:.0f} ms "
                f"{'later' if part.delay_s >= 0.0 else 'earlier'}"
            )
        shares = f"{100.0 * part.within_1:.0f} % of the differences are within one of it, {100.0 * part.within_2:.0f} %"
        yield (
            f"    both expect {part.expected_deg:.2f} rms by their own standard deviations: {shares} within two (if "
            "both are right: 68 and 95 %)"
        )
    yield (
        "the constant part is an upright pose or a mount that was not straight; which of the two is right, a "
        "comparison cannot say"
    )


def check_picture(path: Path) -> None:
    if not find_spec("matplotlib"):
        raise InputError(f"a picture needs matplotlib: {extra('rides')}")
    if path.suffix != ".png":
        raise InputError(f"{path}: the name of the picture must end in .png")


def draw(path: Path, found: Agreement) -> None:
    """Write a PNG with the leans of both devices over time, and the difference of the leans."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MultipleLocator

    figure = Figure(figsize=(14, 7), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    for name, log, width in zip(("smoothed A", "smoothed B"), found.names, (1.6, 0.9)):
        above.plot(found.t_s, found.leans[name], linewidth=width, label=f"{name}: {Path(log).name}")
    above.set(ylabel="lean, deg (> 0 right)")
    for kind, width in (("live", 0.6), ("smoothed", 1.2)):
        difference = found.leans[f"{kind} B"] - found.leans[f"{kind} A"]
        below.plot(found.t_s, difference, linewidth=width, label=f"{kind}, B less A")
    below.set(xlabel="minutes:seconds since A's first sample", ylabel="difference, deg")
    below.xaxis.set_major_locator(MultipleLocator(tick_s(float(found.t_s[-1]))))
    below.xaxis.set_major_formatter(lambda seconds, _: clock(seconds))
    for axis in (above, below):
        axis.margins(x=0.0)
        axis.grid(alpha=0.3)
        for label in axis.legend(loc="upper right").get_texts():
            label.set_parse_math(False)  # a name may contain $
    figure.savefig(path, dpi=100)


def _at_times(t_s: Array, values: Array, at_s: Array) -> Array:
    """Interpolate values at other times. NaN outside the known times, in gaps, and beside values that are NaN."""
    following = np.clip(np.searchsorted(t_s, at_s), 1, len(t_s) - 1)
    near = (at_s >= t_s[0]) & (at_s <= t_s[-1]) & (t_s[following] - t_s[following - 1] < _GAP_S)
    return np.where(near, np.interp(at_s, t_s, values), np.nan)


def _lean_while_riding(ride: SmoothedRide | LeanTable, at_s: Array, riding: Bools) -> tuple[Array, Array]:
    """Return the lean and its standard deviation in degrees; both NaN if one is unknown or the bike is not riding."""
    lean, sigma = (_at_times(ride.t_s, values, at_s) for values in (ride.lean_deg, ride.lean_sigma_deg))
    valid = riding & ~np.isnan(sigma)
    return np.where(valid, lean, np.nan), np.where(valid, sigma, np.nan)


def _difference(a: tuple[Array, Array], b: tuple[Array, Array]) -> Difference | None:
    """Return the Difference of two leans with their standard deviations; None if they have under _LEAST_S in common."""
    (lean_a, sigma_a), (lean_b, sigma_b) = a, b
    valid = ~np.isnan(lean_a) & ~np.isnan(lean_b)
    if np.count_nonzero(valid) * GRID_S < _LEAST_S:
        return None
    difference, expected = lean_b[valid] - lean_a[valid], np.hypot(sigma_a[valid], sigma_b[valid])
    constant = float(difference.mean())
    rest, share = difference - constant, np.abs(difference) / np.maximum(expected, 1e-9)
    slope, delay_s = _slope_and_delay(lean_a, lean_b, valid)
    return Difference(
        seconds=float(len(difference) * GRID_S),
        rms_deg=_rms(difference),
        constant_deg=constant,
        moving_deg=_rms(rest),
        p95_deg=float(np.percentile(np.abs(rest), 95.0)),
        worst_deg=float(np.max(np.abs(rest))),
        slope=slope,
        delay_s=delay_s,
        expected_deg=_rms(expected),
        within_1=float(np.mean(share <= 1.0)),
        within_2=float(np.mean(share <= 2.0)),
    )


def _slope_and_delay(a: Array, b: Array, both: Bools) -> tuple[float | None, float | None]:
    """Return B's lean divided by A's, and B's delay in s, > 0 if B is later; (None, None) if one leans too little.

    a, b: leans in degrees at steps of GRID_S, NaN if unknown. both: True where both are known.
    """
    lean_a, lean_b = a[both] - a[both].mean(), b[both] - b[both].mean()
    if _rms(lean_a) < _LEANED_DEG or _rms(lean_b) < _LEANED_DEG:
        return None, None
    _, axes = np.linalg.eigh(np.cov(lean_a, lean_b))
    principal_a, principal_b = axes[:, -1]  # the axis with the largest variance is the last one
    rate = np.gradient(0.5 * (a + b), GRID_S)
    valid = both & ~np.isnan(rate)
    rate, difference = rate[valid], (b - a - np.mean((b - a)[both]))[valid]
    delay_s = -(rate @ difference) / max(float(rate @ rate), 1e-9)  # least squares: difference = -delay_s * rate
    return float(principal_b / principal_a), float(delay_s)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
