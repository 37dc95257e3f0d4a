"""Where up and forward are, within some degrees: what a motorcycle does in its bends.

In balance the specific force keeps the direction of the bike's own up, so that its mean over the riding is up. A bike
that begins to turn leans: tan(lean) = -speed x yaw rate / g. So the rate about forward, which changes the lean, goes
with minus the change of the yaw rate, which also tells forward from backward.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.errors import Refusal
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ...checks.bends import speed_in_radians
from ...logs.axes.leaning import WINDOW_S, Leaning, averaged, leaned, leaning_of, without_drift
from ...logs.table import Array
from .windows import Windows, known_speed

_MIN_RIDING_S = 30.0
_MIN_LEAN = np.radians(3.0)  # rms: riding straight on tells nothing
_MIN_LIKENESS = 0.5  # correlation between leaning and turning; bikes have over 0.75
_MAX_PUSHED = 0.5  # force to the side over the lean in bends; bikes have 0.1 to 0.2 by their tyres' width
_CAR_G, _CAR_LEAN = 0.045, np.radians(5.0)  # a car's rms of the force to the side is above, of its lean below
_STUCK_MPS = 0.5
_MAX_SPEED_FACTOR = 1.8  # of the log's speed and that of the bends, either way


@dataclass
class FirstGuess:
    """matrix (3, 3): vehicle from sensor, rows left, up, forward. bias (3): of the gyro, rad/s, sensor's axes. lean
    (n + 1, rad) and speed (n + 1, m/s): where the windows begin, and where the last one ends."""

    matrix: Array
    bias: Array
    lean: Array
    speed: Array


def first_guess(windows: Windows) -> FirstGuess:
    """Raises Refusal where the ride is none of a motorcycle, or tells nothing."""
    riding = ~windows.still
    seconds = float(np.count_nonzero(riding)) * WINDOW_S
    if seconds < _MIN_RIDING_S:
        raise Refusal("ride-short", seconds, _MIN_RIDING_S)
    bias = _bias(windows)
    rate = windows.rate - bias
    found = leaning_of(rate, windows.force, riding)
    left = found.matrix[0]
    _refuse_no_motorcycle(found, without_drift(windows.force @ left), riding)
    known = known_speed(windows.time_s, windows.speed)
    _refuse_wrong_speed(known[riding], found.rolled[riding], found.turned[riding])
    speed = np.where(np.isnan(known), np.where(riding, found.speed, 0.0), known)
    lean = leaned(found.rolled, found.yaw, speed)
    return FirstGuess(found.matrix, bias, _borders(lean), _borders(speed))


def _bias(windows: Windows) -> Array:
    """At rest the mean rate; without a standstill the usual one, because most of a ride is nearly straight."""
    for places in (windows.still, windows.calm):
        if np.any(places):
            return np.median(windows.rate[places], axis=0)
    return np.median(averaged(windows.rate, 1.0), axis=0)


def _refuse_no_motorcycle(found: Leaning, sideways: Array, riding: NDArray[np.bool_]) -> None:
    """sideways (n): force to the left, g, changes within some seconds only."""
    in_radians_mps = speed_in_radians(found)
    if in_radians_mps is not None:
        raise Refusal("rates-in-radians", in_radians_mps)
    rolled, turned, sideways = found.rolled[riding], found.turned[riding], sideways[riding]
    lean, side = float(np.sqrt(np.mean(rolled**2))), float(np.sqrt(np.mean(sideways**2)))
    pushed = abs(float(sideways @ turned)) / max(abs(float(rolled @ turned)), 1e-30)
    if pushed > _MAX_PUSHED and side > _CAR_G and lean < _CAR_LEAN:
        raise Refusal("not-leaning")
    if lean < _MIN_LEAN:
        raise Refusal("no-bends", float(np.degrees(lean)))
    if pushed > _MAX_PUSHED or found.likeness < _MIN_LIKENESS:
        raise Refusal("ride-contradicts")
    # a leaned bike that turns also turns about its own left
    if found.share < 0.0:
        raise Refusal("left-handed")


def _refuse_wrong_speed(known: Array, rolled: Array, turned: Array) -> None:
    """known: m/s, NaN if unknown. The speed of the bends is the one whose yaw rates go with the lean."""
    if not len(known) or np.isnan(known[0]):
        return
    if np.ptp(known) < _STUCK_MPS:
        raise Refusal("speed-stuck", float(known[0]))
    expected = known * turned
    both = -float(expected @ rolled) * STANDARD_GRAVITY
    factor = float(expected @ expected) / both if both > 0.0 else 0.0
    if not 1.0 / _MAX_SPEED_FACTOR < factor < _MAX_SPEED_FACTOR:
        raise Refusal("speed-unit", factor)


def _borders(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))
