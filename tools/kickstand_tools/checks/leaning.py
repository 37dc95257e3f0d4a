"""Relates a motorcycle's lean to its yaw rate, to find forward, the handedness and the unit of the rates.

A bike leans when it begins to turn: tan(lean) = -speed x yaw rate / g. The rate about forward changes the lean, so it
correlates with minus the change of the yaw rate. The sign distinguishes forward from backward. The rate of a leaning
bike about its own left is yaw rate x sin(lean). Rates in rad/s are 57 times too small. Then this product is 57 x 57
times too small, but the rate about left only 57 times. Logs of a parked vehicle or of a car are never judged.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..common.messages import Message, Remedy, WrongAxes, kind
from ..logs.log import BIN_S, LogBins
from ..signals import Array, Bools, moving_mean, moving_spread

WINDOW_S = 0.2  # length of the windows over which rates and forces are averaged
SMOOTH_S = 0.6  # length of the moving mean that smooths rates before their changes are compared
SLOW_S = 12.0  # a slower change of lean cannot be distinguished from the gyro's drift
# If share, sigmas and correlation of a Leaning exceed these limits, its rates are in rad/s. In simulated and recorded
# rides, the share was 1.0 to 1.6 for rates in deg/s. It was 57 to 92 for rates in rad/s, at over 5 sigmas. Cars had a
# correlation under 0.6.
SHARE, SIGMAS, CORRELATION = 15.0, 4.5, 0.65
# Smallest rms of the lean, in rad, for a ride that is not nearly straight. The limit is this small, because a lean of
# 2 degrees looks like 2 / 57.3 degrees if rates in rad/s are read as deg/s.
LEAST_LEAN = np.radians(2.0 / 57.3)

# Unit of the rates

JUDGED_S, RIDING_S = 1800.0, 15.0  # the last JUDGED_S are judged if they have RIDING_S of riding
# The bike is riding if the standard deviation of its rates over MOVES_S is over MOVES times its 95th percentile.
MOVES_S, MOVES = 1.6, 0.1
# The calmest seconds are the share CALMEST of all seconds, but at least LEAST seconds. In calm_rates(), the standard
# deviation CALM_G of the force counts as much as the standard deviation calm_rate of the rates.
CALMEST, LEAST, CALM_G = 0.2, 3, 0.02
# The gyro's bias is known if the share AGREE of the calmest seconds is within AGREE_DPS. Otherwise the FEW calmest
# seconds are tried. In a ride that is mostly one long, steady bend, these few seconds are a standstill.
AGREE, FEW, AGREE_DPS = 0.8, 5, 3.0


@dataclass
class Leaning:
    """How a motorcycle's lean relates to its yaw rate."""

    matrix: Array  # rough rotation from sensor to vehicle axes, shape (3, 3). The rows are left, up and forward.
    rolled: Array  # lean without its slow changes (see without_drift()), shape (n), in rad
    turned: Array  # yaw rate without its slow changes, positive to the left, shape (n), in rad/s
    correlation: float  # of rolled and -turned while riding
    speed: float  # at which yaw rate and lean balance, by regression, in m/s
    # ratio of the rate about left to yaw rate x sin(lean), by regression. It is 1 if the axes are right-handed and
    # the rates in deg/s.
    share: float
    sigmas: float  # |share| divided by its standard deviation


def leaning_of(rate: Array, force: Array, riding: Bools) -> Leaning:
    """Compute the Leaning of n windows of WINDOW_S.

    rate: rates without bias, shape (n, 3), in rad/s.
    force: forces in any unit, shape (n, 3).
    riding: True for the windows from which axes, speed and share are computed. The lean is integrated over all windows.
    """
    left, up, forward = axes = _rough_axes(rate, force, riding)
    yaw = rate @ up
    rolled, turned = without_drift(np.cumsum(rate @ forward) * WINDOW_S), without_drift(yaw)
    covariance = -float(rolled[riding] @ turned[riding])
    rolled_squared, turned_squared = (float(values[riding] @ values[riding]) for values in (rolled, turned))
    speed = covariance / max(turned_squared, 1e-30) * STANDARD_GRAVITY
    expected = yaw * np.sin(leaned(rolled, yaw, speed))
    share, sigma = _regression(expected[riding], (rate @ left)[riding])
    return Leaning(
        matrix=axes,
        rolled=rolled,
        turned=turned,
        correlation=covariance / float(np.sqrt(max(rolled_squared * turned_squared, 1e-30))),
        speed=speed,
        share=share,
        sigmas=abs(share) / max(sigma, 1e-12),
    )


def _rough_axes(rate: Array, force: Array, riding: Bools) -> Array:
    """Return the rows left, up and forward: up is the mean force, and the rate about forward changes the yaw rate."""
    up = _unit(force[riding].mean(axis=0))
    yaw = averaged(rate @ up, SMOOTH_S)
    level = averaged(rate - np.outer(rate @ up, up), SMOOTH_S)
    forward = -np.gradient(yaw)[riding] @ (level - level.mean(axis=0))[riding]
    forward = _unit(forward - up * (forward @ up))
    return np.array([np.cross(up, forward), up, forward])


def _regression(cause: Array, effect: Array) -> tuple[float, float]:
    """Return the factor from the changes of the cause to those of the effect, and its standard deviation."""
    cause, effect = cause - cause.mean(), effect - effect.mean()
    size = max(float(cause @ cause), 1e-30)
    factor = float(cause @ effect) / size
    return factor, float(np.sqrt(np.mean((effect - factor * cause) ** 2) / size))


def speed_in_radians(leaning: Leaning) -> float | None:
    """Return the speed in bends, in m/s, that these rates would mean in deg/s; None if not surely in rad/s."""
    wrong = leaning.share > SHARE and leaning.sigmas > SIGMAS and leaning.correlation > CORRELATION
    leans = np.sqrt(np.mean(leaning.rolled**2)) > LEAST_LEAN
    return float(np.degrees(leaning.speed)) if wrong and leans else None


def leaned(rolled: Array, yaw: Array, speed: Array | float) -> Array:
    """Return the lean in rad: `rolled`, and for changes slower than SLOW_S the balance at this speed and yaw rate."""
    balanced = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    return rolled + balanced - without_drift(balanced)


def averaged(values: Array, seconds: float) -> Array:
    """Compute the moving mean of the windows' values, shape (n) or (n, k), over some seconds."""
    return moving_mean(values, _windows(seconds))


def without_drift(values: Array) -> Array:
    """Remove the slow changes of n values: average them twice over SLOW_S, and subtract the result."""
    return values - averaged(averaged(values, SLOW_S), SLOW_S)


def moving_deviation(values: Array, over_s: float) -> Array:
    """Return the largest of the moving standard deviations of three components, shape (n, 3), over over_s seconds."""
    return moving_spread(values, _windows(over_s)).max(axis=1, initial=0.0)


def _windows(seconds: float) -> int:
    return 2 * max(1, round(seconds / WINDOW_S / 2.0)) + 1


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


RatesInRadians = kind(
    "rates-in-radians",
    "speed_mps",  # the impossible speed in bends that these rates would mean in deg/s
    "in bends the rates are those of {speed_mps:.0f} m/s",
    Remedy("are they in rad/s? deg/s are needed"),
    WrongAxes,
)


def bends(bins: LogBins) -> Message | None:
    """Return a notice if the rates seem to be in rad/s; None if they seem right, or the log is not enough to judge."""
    force, rate, _ = bins.means(round(WINDOW_S / BIN_S))
    valid = np.flatnonzero(~np.isnan(force[:, 0]))[-round(JUDGED_S / WINDOW_S) :]
    force, rate = force[valid], np.radians(rate[valid])
    if len(rate) * WINDOW_S < RIDING_S:
        return None
    changes = moving_deviation(rate, MOVES_S)
    moves = MOVES * np.percentile(changes, 95)  # the limit is relative, because the unit of the rates is unknown
    if np.count_nonzero(changes > moves) * WINDOW_S < RIDING_S:
        return None
    per_second = round(1.0 / WINDOW_S)
    seconds = len(rate) // per_second
    shape = seconds, per_second, 3
    force_by_second, rate_by_second = (values[: seconds * per_second].reshape(shape) for values in (force, rate))
    calm = calm_rates(force_by_second, rate_by_second, moves)
    bias = calm_bias(np.degrees(calm))
    if bias is None:
        return None
    rate -= np.radians(bias)
    speed = speed_in_radians(leaning_of(rate, force, changes > moves))
    return None if speed is None else RatesInRadians(speed)


def calm_bias(calm: Array) -> Array | None:
    """Return the gyro's bias, shape (3), in deg/s, from calm_rates() in deg/s; None if the rates differ too much."""
    for rates in (calm, calm[:FEW]):
        bias = np.median(rates, axis=0)
        if np.mean(np.linalg.norm(rates - bias, axis=1) < AGREE_DPS) > AGREE:
            return bias
    return None


def calm_rates(force: Array, rate: Array, calm_rate: float) -> Array:
    """Return the mean rates in the calmest of m seconds, the calmest first, from values of shape (m, bins, 3).

    calm_rate: the standard deviation of the rates that counts as much as a standard deviation CALM_G of the force.
    """
    changes = np.sum(np.std(force, axis=1), axis=1) / CALM_G + np.sum(np.std(rate, axis=1), axis=1) / calm_rate
    return np.mean(rate, axis=1)[np.argsort(changes)[: max(LEAST, round(CALMEST * len(changes)))]]
