"""Relates a motorcycle's lean to its yaw rate, to find forward, the handedness and the unit of the rates.

A bike that begins to turn leans: tan(lean) = -speed x yaw rate / g. So the rate about forward, which changes the lean,
correlates with minus the change of the yaw rate. The sign distinguishes forward from backward. A leaning bike's rate
about its own left is yaw rate x sin(lean). This product shows the handedness and the unit of the rates.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from . import Array, Bools, moving_mean, moving_spread

WINDOW_S = 0.2  # rates and forces are means over windows of this length
SMOOTH_S = 0.6  # rates are moving means over this time before their changes are compared
SLOW_S = 12.0  # changes of lean that take longer cannot be separated from the gyro's drift
# Rates are in rad/s if a Leaning exceeds all three. Simulated rides and recordings in deg/s have a share of 1.0 to 1.6,
# in rad/s of 57 to 92, at over 5 sigmas; cars have a likeness under 0.6.
SHARE, SIGMAS, LIKENESS = 15.0, 4.5, 0.65
LEAST_LEAN = np.radians(2.0 / 57.3)  # rms: a ride with less lean is nearly straight; 2 degrees if rates are in rad/s


@dataclass
class Leaning:
    """matrix (3, 3): vehicle from sensor, rows left, up, forward, roughly. rolled (n, rad): lean without its slow
    changes (see without_drift()). turned (n, rad/s): yaw rate, positive to the left, also without its slow changes.
    likeness: correlation of rolled and -turned while riding. speed (m/s): the one that balances yaw rate and lean, by
    regression. share: rate about left over yaw rate x sin(lean), by regression: 1 if the axes are right-handed and the
    rates in deg/s. sigmas: |share| over its standard deviation.
    """

    matrix: Array
    rolled: Array
    turned: Array
    likeness: float
    speed: float
    share: float
    sigmas: float


def leaning_of(rate: Array, force: Array, riding: Bools) -> Leaning:
    """The Leaning of n windows of WINDOW_S. rate (n, 3, rad/s): without bias. force (n, 3). riding (n): True for the
    windows to use."""
    up = _unit(force[riding].mean(axis=0))
    yaw = averaged(rate @ up, SMOOTH_S)
    level = averaged(rate - np.outer(rate @ up, up), SMOOTH_S)
    forward = -np.gradient(yaw)[riding] @ (level - level.mean(axis=0))[riding]
    forward = _unit(forward - up * (forward @ up))
    left = np.cross(up, forward)
    rolled, yaw = without_drift(np.cumsum(rate @ forward) * WINDOW_S), rate @ up
    turned = without_drift(yaw)
    both, squared = -float(rolled[riding] @ turned[riding]), float(turned[riding] @ turned[riding])
    speed = both / max(squared, 1e-30) * STANDARD_GRAVITY
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
        both / float(np.sqrt(max(float(rolled[riding] @ rolled[riding]) * squared, 1e-30))),
        speed,
        share,
        abs(share) / max(float(noise), 1e-12),
    )


def speed_in_radians(found: Leaning) -> float | None:
    """Detect rates in rad/s that are labelled deg/s, and are thus 57 times too small. Returns the impossible speed in
    bends, m/s, that deg/s would mean; None if the rates are not surely in rad/s."""
    wrong = found.share > SHARE and found.sigmas > SIGMAS and found.likeness > LIKENESS
    return float(np.degrees(found.speed)) if wrong and leans(found) else None


def leans(found: Leaning) -> bool:
    """True if the bike leans at all: the rms of the lean is over LEAST_LEAN."""
    return float(np.sqrt(np.mean(found.rolled**2))) > LEAST_LEAN


def leaned(rolled: Array, yaw: Array, speed: Array | float) -> Array:
    """(n, rad): the lean. Its quick changes come from `rolled`; its slow changes (slower than SLOW_S) come from the
    lean that balances the yaw rate at this speed."""
    balanced = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    return rolled + balanced - without_drift(balanced)


def averaged(values: Array, seconds: float) -> Array:
    """Moving mean over this time of windows' values (n) or (n, k)."""
    return moving_mean(values, _windows(seconds))


def without_drift(values: Array) -> Array:
    """values (n) without their slow changes: minus their moving mean over SLOW_S, taken twice."""
    return values - averaged(averaged(values, SLOW_S), SLOW_S)


def unrest(values: Array, over_s: float) -> Array:
    """(n): moving standard deviation of values (n, 3) over over_s seconds, the largest of the three components."""
    return moving_spread(values, _windows(over_s)).max(axis=1, initial=0.0)


def _windows(seconds: float) -> int:
    """The odd number of windows that last about this time."""
    return 2 * max(1, round(seconds / WINDOW_S / 2.0)) + 1


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
