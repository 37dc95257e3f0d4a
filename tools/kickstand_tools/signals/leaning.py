"""Relates a motorcycle's lean to its yaw rate, to find forward, the handedness and the unit of the rates.

A bike leans when it begins to turn: tan(lean) = -speed x yaw rate / g. The rate about forward changes the lean, so it
correlates with minus the change of the yaw rate. The sign distinguishes forward from backward. The rate of a leaning
bike about its own left is yaw rate x sin(lean). This product shows the handedness and the unit of the rates.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from . import Array, Bools, moving_mean, moving_spread

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


@dataclass
class Leaning:
    """How a motorcycle's lean relates to its yaw rate.

    matrix: rough rotation from sensor to vehicle axes, shape (3, 3). The rows are left, up and forward.
    rolled: lean without its slow changes (see without_drift()), shape (n), in rad.
    turned: yaw rate without its slow changes, positive to the left, shape (n), in rad/s.
    correlation: correlation of rolled and -turned while riding.
    speed: speed at which yaw rate and lean balance, by regression, in m/s.
    share: ratio of the rate about left to yaw rate x sin(lean), by regression. It is 1 if the axes are right-handed and
        the rates in deg/s.
    sigmas: |share| divided by its standard deviation.
    """

    matrix: Array
    rolled: Array
    turned: Array
    correlation: float
    speed: float
    share: float
    sigmas: float


def leaning_of(rate: Array, force: Array, riding: Bools) -> Leaning:
    """Compute the Leaning of n windows of WINDOW_S.

    rate: rates without bias, shape (n, 3), in rad/s.
    force: forces in any unit, shape (n, 3).
    riding: True for the windows from which axes, speed and share are computed, shape (n). The lean itself is integrated
        over all windows.
    """
    up = _unit(force[riding].mean(axis=0))
    yaw = averaged(rate @ up, SMOOTH_S)
    level = averaged(rate - np.outer(rate @ up, up), SMOOTH_S)
    forward = -np.gradient(yaw)[riding] @ (level - level.mean(axis=0))[riding]
    forward = _unit(forward - up * (forward @ up))
    left = np.cross(up, forward)
    rolled, yaw = without_drift(np.cumsum(rate @ forward) * WINDOW_S), rate @ up
    turned = without_drift(yaw)
    covariance, squared = -float(rolled[riding] @ turned[riding]), float(turned[riding] @ turned[riding])
    speed = covariance / max(squared, 1e-30) * STANDARD_GRAVITY
    expected = (yaw * np.sin(leaned(rolled, yaw, speed)))[riding]
    expected -= expected.mean()
    about_left = (rate @ left)[riding]
    about_left -= about_left.mean()
    size = max(float(expected @ expected), 1e-30)
    share = float(expected @ about_left) / size
    noise = np.sqrt(np.mean((about_left - share * expected) ** 2) / size)
    return Leaning(
        np.array([left, up, forward]),
        rolled,
        turned,
        covariance / float(np.sqrt(max(float(rolled[riding] @ rolled[riding]) * squared, 1e-30))),
        speed,
        share,
        abs(share) / max(float(noise), 1e-12),
    )


def speed_in_radians(leaning: Leaning) -> float | None:
    """Detect rates in rad/s that are labelled deg/s, so they are 57 times too small.

    Returns the impossible speed in bends, in m/s, that these rates would mean in deg/s. Returns None if the rates are
    not surely in rad/s.
    """
    wrong = leaning.share > SHARE and leaning.sigmas > SIGMAS and leaning.correlation > CORRELATION
    return float(np.degrees(leaning.speed)) if wrong and leans(leaning) else None


def leans(leaning: Leaning) -> bool:
    """True if the bike leans at all: the rms of the lean is over LEAST_LEAN."""
    return float(np.sqrt(np.mean(leaning.rolled**2))) > LEAST_LEAN


def leaned(rolled: Array, yaw: Array, speed: Array | float) -> Array:
    """Return the lean, shape (n), in rad.

    Changes faster than SLOW_S come from `rolled`. Slower changes come from the lean at which a bike with this speed and
    yaw rate is in balance.
    """
    balanced = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    return rolled + balanced - without_drift(balanced)


def averaged(values: Array, seconds: float) -> Array:
    """Compute the moving mean of the windows' values over some seconds. values: shape (n) or (n, k)."""
    return moving_mean(values, _windows(seconds))


def without_drift(values: Array) -> Array:
    """Remove the slow changes of n values: average them twice over SLOW_S, and subtract the result."""
    return values - averaged(averaged(values, SLOW_S), SLOW_S)


def moving_deviation(values: Array, over_s: float) -> Array:
    """Compute the moving standard deviation of three components over over_s seconds.

    values: three components at each time, shape (n, 3).
    Returns the largest of the three standard deviations at each time, shape (n).
    """
    return moving_spread(values, _windows(over_s)).max(axis=1, initial=0.0)


def _windows(seconds: float) -> int:
    """Return the odd number of windows that last about this many seconds."""
    return 2 * max(1, round(seconds / WINDOW_S / 2.0)) + 1


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
