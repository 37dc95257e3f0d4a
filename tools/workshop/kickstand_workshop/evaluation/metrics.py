"""Measures how well a shown lean follows the true lean."""

from dataclasses import dataclass

import numpy as np
from kickstand_tools.signals import peak_offset
from numpy.typing import NDArray

LEANED_DEG = 10.0  # smallest true lean for the fit of the slope, because most of a ride is nearly upright
_LAG_RANGE_S = (-0.2, 0.8)  # smallest and largest lag to try
_LAG_SMOOTHING_S = 0.05
_STILL_DPS = 1.0  # no lag is computed if the true roll rate has a smaller rms
# On a straight, yaw rate and lean stay below the first two limits and the speed above the third. A straight lasts
# _STRAIGHT_S or longer
_STRAIGHT_DPS, _STRAIGHT_DEG, _STRAIGHT_MPS, _STRAIGHT_S = 2.0, 6.0, 5.0, 1.0


@dataclass
class LeanScore:
    """The errors of a shown lean. A figure is NaN if the ride does not determine it."""

    rms_deg: float  # root of the mean square of the error
    p95_deg: float  # 95th percentile of the absolute error
    worst_deg: float  # largest absolute error
    slope: float  # shown lean divided by true lean
    lag_ms: float  # delay of the shown lean. Positive if the lean is late.
    straight_bias_deg: float  # mean error on straights in the last tenth of the ride


def rms(error: NDArray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(error * error)))


def slope(shown: NDArray, true: NDArray, beyond: float = LEANED_DEG) -> float:
    """Fit a line through the origin to the shown lean over the true lean. Returns its slope, or NaN without samples.

    beyond: only samples with a larger true lean are used, in degrees.
    """
    leaned = np.abs(true) > beyond
    square = float(np.sum(true[leaned] ** 2))
    return float(np.sum(shown[leaned] * true[leaned]) / square) if square > 0.0 else float("nan")


def lag_ms(shown: NDArray, true: NDArray, rate_hz: float) -> float:
    """Find the delay of the shown roll rate at which it correlates best with the true roll rate.

    The delay is refined by a parabola. Returns the delay in ms, or NaN if no delay is found.
    """
    width = max(round(_LAG_SMOOTHING_S * rate_hz), 1)
    window = np.full(width, 1.0 / width)
    a, b = (np.convolve(np.gradient(x) * rate_hz, window, mode="same") for x in (shown, true))
    if float(np.std(b)) < _STILL_DPS:
        return float("nan")
    shifts = np.arange(round(_LAG_RANGE_S[0] * rate_hz), round(_LAG_RANGE_S[1] * rate_hz) + 1)
    edge = int(np.max(np.abs(shifts)))
    inner = b[edge : len(b) - edge]
    match = np.array([a[edge + k : len(a) - edge + k] @ inner for k in shifts])
    best = int(np.argmax(match))
    if not 0 < best < len(shifts) - 1:
        return float("nan")
    return float((shifts[best] + peak_offset(match[best - 1 : best + 2])) / rate_hz * 1000.0)


def straights(truth: dict[str, NDArray], rate_hz: float) -> NDArray[np.bool_]:
    """Return True where the bike has ridden straight ahead for at least a second at over 5 m/s, shape (n)."""
    is_straight = (
        (np.abs(truth["yaw_rate_dps"]) < _STRAIGHT_DPS)
        & (np.abs(truth["lean_deg"]) < _STRAIGHT_DEG)
        & (truth["speed_mps"] > _STRAIGHT_MPS)
    )
    since = np.arange(len(is_straight)) - np.maximum.accumulate(np.where(is_straight, -1, np.arange(len(is_straight))))
    return since > _STRAIGHT_S * rate_hz


def score(shown: NDArray, truth: dict[str, NDArray], rate_hz: float) -> LeanScore:
    """Score a shown lean from the moment the bike sets off to the end of the ride.

    If the bike never sets off, only the first second of the ride is left out.

    shown: lean in degrees, shape (N).
    truth: lean_deg, speed_mps and yaw_rate_dps, each of shape (N).
    """
    off = truth["speed_mps"] > 0.5
    first = int(np.argmax(off)) if off.any() else round(rate_hz)
    true = truth["lean_deg"]
    error = (shown - true)[first:]
    late = straights(truth, rate_hz)
    late[: round(0.9 * len(late))] = False
    return LeanScore(
        rms(error),
        float(np.percentile(np.abs(error), 95.0)),
        float(np.max(np.abs(error))),
        slope(shown[first:], true[first:]),
        lag_ms(shown[first:], true[first:], rate_hz),
        float(np.mean((shown - true)[late])) if late.any() else float("nan"),
    )
