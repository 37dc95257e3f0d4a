"""Compares the leans of two devices on one bike, to test a lean meter without a reference.

The comparison does not show errors that both devices share, such as errors of the bike's model. The comparison shows
the errors that each device has alone: of its sensor, its mount and its calibration. If both devices are equally good,
each device's error is the difference divided by the square root of two.
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
from ..signals import Array, Bools
from .clocks import Clocks, clocks
from .motion import motion

STEP_S = 0.02
_RIDING_MPS = 3.0
_GAP_S = 0.2  # the lean is unknown between samples that are further apart
_LEAST_S = 20.0  # least time of riding to compare
_LEANED_DEG = 3.0  # delay and slope are computed only for a larger rms of the lean


@dataclass
class Difference:
    """B's lean minus A's lean, in degrees.

    seconds: time of riding that is compared.
    rms_deg: rms of the difference.
    constant_deg: mean of the difference, caused by poses and mounts.
    moving_deg: rms of the difference without its mean.
    p95_deg: 95 % of the absolute differences without the mean are below this value.
    worst_deg: the largest absolute difference without the mean.
    slope: B's lean divided by A's lean, None if the ride leans too little.
    delay_s: delay of B's lean in s, None if the ride leans too little.
    expected_deg: the rms predicted by both standard deviations.
    within_1, within_2: shares of the differences within one and two standard deviations.
    """

    seconds: float
    rms_deg: float
    constant_deg: float
    moving_deg: float
    p95_deg: float
    worst_deg: float
    slope: float | None
    delay_s: float | None
    expected_deg: float
    within_1: float
    within_2: float


@dataclass
class Agreement:
    """The agreement of rides A and B.

    live: Difference of the displayed leans while both devices show a lean. None without such a time.
    smoothed: Difference of the smoothed leans.
    t_s: seconds since A's first sample, shape (n).
    The leans at these times are in degrees, shape (n), NaN if unknown.
    names: the names of A's and B's logs.
    """

    clocks: Clocks
    live: Difference | None
    smoothed: Difference
    t_s: Array
    leans: dict[str, Array]
    notices: dict[str, list[Message]] = field(default_factory=dict)
    names: tuple[str, str] = ("", "")

    def as_data(self) -> dict[str, Any]:
        """All fields except the leans, for JSON."""
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

    a, b: see read_log. progress: called with (done, total) of the samples, ride by ride. Raises InputError, also if the
    recordings are of different rides.

    >>> from kickstand_tools.api import Log, simulate_ride
    >>> made = simulate_ride("street", seed=1, seconds=90.0)
    >>> axes, log = made.vehicle_from_sensor, Log.from_readings(made.readings, made.rate_hz)
    >>> calibration = CalibrationFile(vehicle_from_sensor=axes, aligned=True)
    >>> compare_rides(log, log, calibration, calibration).smoothed.rms_deg
    0.0
    """
    checked = [read_ride(source, calibration) for source, calibration in ((a, calibration_a), (b, calibration_b))]
    try:
        relation = clocks(motion(checked[0]), motion(checked[1]), calibration_a, calibration_b)
    except InputError as error:
        raise InputError(f"{name_of(a)}, {name_of(b)}: {error}") from error
    pairs = list(zip(checked, (calibration_a, calibration_b)))
    rides = [smooth_checked(*pair, progress) for pair in pairs]
    displayed = [replay_checked(*pair) for pair in pairs]
    t_s = np.arange(0.0, rides[0].t_s[-1], STEP_S)
    times_s = t_s, relation.of_b(t_s)
    riding = np.ones(len(t_s), dtype=bool)
    for ride, time_s in zip(rides, times_s):
        riding &= _interpolated(ride.t_s, ride.speed_mps, time_s) > _RIDING_MPS  # False for NaN
    smoothed = [_lean_while_riding(ride, time_s, riding) for ride, time_s in zip(rides, times_s)]
    live = [_lean_while_riding(lean, time_s, riding) for lean, time_s in zip(displayed, times_s)]
    difference = _difference(*smoothed)
    if difference is None:
        raise InputError(f"{name_of(a)}, {name_of(b)}: under {_LEAST_S:.0f} s of riding in common")
    names = ("live A", "live B", "smoothed A", "smoothed B")
    leans: dict[str, Array] = dict(zip(names, (lean for lean, _ in (*live, *smoothed))))
    notices = {name: ride.notices for name, ride in zip("ab", rides)}
    return Agreement(relation, _difference(*live), difference, t_s, leans, notices, (name_of(a), name_of(b)))


def words(found: Agreement) -> Iterator[str]:
    """Yield the result in words, line by line."""
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
    """Raise InputError if no picture can be drawn."""
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


def _interpolated(t_s: Array, values: Array, at_s: Array) -> Array:
    """Interpolate values at other times. NaN outside the known times, in gaps, and beside values that are NaN."""
    following = np.clip(np.searchsorted(t_s, at_s), 1, len(t_s) - 1)
    near = (at_s >= t_s[0]) & (at_s <= t_s[-1]) & (t_s[following] - t_s[following - 1] < _GAP_S)
    return np.where(near, np.interp(at_s, t_s, values), np.nan)


def _lean_while_riding(ride: SmoothedRide | LeanTable, at_s: Array, riding: Bools) -> tuple[Array, Array]:
    """Return the lean and its standard deviation in degrees, both of shape (n). Both are NaN if the lean or the
    standard deviation is unknown, or the bike is not riding."""
    lean, sigma = (_interpolated(ride.t_s, values, at_s) for values in (ride.lean_deg, ride.lean_sigma_deg))
    valid = riding & ~np.isnan(sigma)
    return np.where(valid, lean, np.nan), np.where(valid, sigma, np.nan)


def _difference(a: tuple[Array, Array], b: tuple[Array, Array]) -> Difference | None:
    """The Difference of two leans with their standard deviations; None if they have under _LEAST_S in common."""
    valid = ~np.isnan(a[0]) & ~np.isnan(b[0])
    if np.count_nonzero(valid) * STEP_S < _LEAST_S:
        return None
    lean_a, lean_b = a[0][valid], b[0][valid]
    difference, expected = lean_b - lean_a, np.hypot(a[1][valid], b[1][valid])
    constant = float(difference.mean())
    rest, share = difference - constant, np.abs(difference) / np.maximum(expected, 1e-9)
    slope, delay_s = _slope_and_delay(a[0], b[0], valid)
    return Difference(
        float(len(difference) * STEP_S),
        _rms(difference),
        constant,
        _rms(rest),
        float(np.percentile(np.abs(rest), 95.0)),
        float(np.max(np.abs(rest))),
        slope,
        delay_s,
        _rms(expected),
        float(np.mean(share <= 1.0)),
        float(np.mean(share <= 2.0)),
    )


def _slope_and_delay(a: Array, b: Array, both: Bools) -> tuple[float | None, float | None]:
    """Slope and delay of B's lean relative to A's. Both leans are treated as equally exact: the slope is the slope of
    the principal axis, and the delay is fitted to the mean of both roll rates."""
    lean_a, lean_b = a[both] - a[both].mean(), b[both] - b[both].mean()
    if _rms(lean_a) < _LEANED_DEG or _rms(lean_b) < _LEANED_DEG:
        return None, None
    axis = np.linalg.eigh(np.cov(lean_a, lean_b))[1][:, -1]
    rate = np.gradient(0.5 * (a + b), STEP_S)
    valid = both & ~np.isnan(rate)
    difference = b - a - np.mean((b - a)[both])
    return float(axis[1] / axis[0]), float(
        -(rate[valid] @ difference[valid]) / max(float(rate[valid] @ rate[valid]), 1e-9)
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
