"""A motorcycle's leaning against its turning, from its rates alone.

A bike that begins to turn leans: tan(lean) = -speed x yaw rate / g. So the rate about forward, which changes the lean,
goes with minus the change of the yaw rate, which also parts forward from backward. Leaned, it turns about its own left
too, by yaw rate x sin(lean): as a product of two quantities, that shows handedness and the unit of the rates.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from . import Array
from .averages import moving_mean, moving_spread

WINDOW_S = 0.2  # rates and forces are means over it
SMOOTH_S = 0.6  # of the rates whose changes are compared
SLOW_S = 12.0  # leans that last longer cannot be parted from the drift of the gyro
# Simulated rides and recordings in deg/s have a share of 1.0 to 1.6 and in rad/s of 57 to 92, of over 5 sigmas; cars
# have a likeness under 0.6.
SHARE, SIGMAS, LIKENESS = 15.0, 4.5, 0.65
LEAST_LEAN = np.radians(2.0 / 57.3)  # rms: less is nearly straight


@dataclass
class Leaning:
    """matrix (3, 3): vehicle from sensor, rows left, up, forward, about. rolled (n, rad): lean without what changes
    slowly. yaw (n, rad/s): positive to the left; turned (n): the same without what changes slowly. likeness:
    correlation of rolled and -turned while riding. speed: the usual one that goes with both, m/s. share: the rate about
    left in parts of yaw x sin(lean): 1 where the axes are right-handed and the rates in their unit. sigmas: how far the
    share is from 0.
    """

    matrix: Array
    rolled: Array
    yaw: Array
    turned: Array
    likeness: float
    speed: float
    share: float
    sigmas: float


def leaning_of(rate: Array, force: Array, riding: NDArray[np.bool_]) -> Leaning:
    """n windows of WINDOW_S. rate (n, 3, rad/s) without bias, force (n, 3), riding (n): those that are compared."""
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
        yaw,
        turned,
        both / float(np.sqrt(max(float(rolled[riding] @ rolled[riding]) * squared, 1e-30))),
        speed,
        share,
        abs(share) / max(float(noise), 1e-12),
    )


def speed_in_radians(found: Leaning) -> float | None:
    """The speed of the bends, m/s, if the rates, which are 57 times too small, are deg/s; None where they may be."""
    wrong = found.share > SHARE and found.sigmas > SIGMAS and found.likeness > LIKENESS
    return float(np.degrees(found.speed)) if wrong and leans(found) else None


def leans(found: Leaning) -> bool:
    """Enough for its leaning to show anything."""
    return float(np.sqrt(np.mean(found.rolled**2))) > LEAST_LEAN


def leaned(rolled: Array, yaw: Array, speed: Array | float) -> Array:
    """(n, rad) the lean whose changes are rolled's, and which over long is that of a balanced bend at this speed."""
    balanced = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    return rolled + balanced - without_drift(balanced)


def averaged(values: Array, seconds: float) -> Array:
    """Mean over so many seconds around each window; (n) or (n, k)."""
    return moving_mean(values, _windows(seconds))


def without_drift(values: Array) -> Array:
    """(n) less what changes more slowly than SLOW_S."""
    return values - averaged(averaged(values, SLOW_S), SLOW_S)


def unrest(values: Array, over_s: float) -> Array:
    """(n): standard deviation within over_s, of the component that has the largest; values (n, 3)."""
    return moving_spread(values, _windows(over_s)).max(axis=1, initial=0.0)


def _windows(seconds: float) -> int:
    """An odd number of windows that are about so long."""
    return 2 * max(1, round(seconds / WINDOW_S / 2.0)) + 1


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
