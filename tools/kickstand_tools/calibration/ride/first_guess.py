"""Where up and forward are, within some degrees: what a motorcycle does in its bends.

In balance the specific force keeps the direction of the bike's own up, so that its mean over the riding is up. A bike
that begins to turn leans: tan(lean) = -speed x yaw rate / g. So the rate about forward, which changes the lean, goes
with minus the change of the yaw rate, which also tells forward from backward.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.errors import Refusal
from kickstand.units import STANDARD_GRAVITY

from ...logs.table import Array
from .windows import WINDOW_S, Windows, averaged, known_speed

_SMOOTH_S = 0.6  # of the rates whose changes are compared
_SLOW_S = 12.0  # leans that last longer are not told from the drift of the gyro
_MIN_RIDING_S = 30.0
_MIN_LEAN = np.radians(3.0)  # rms: riding straight on tells nothing
_MIN_LIKENESS = 0.5  # correlation between leaning and turning; bikes have over 0.8
_MAX_SIDEWAYS = 0.5  # of the lean: force to the side in bends; bikes have 0.1 to 0.2 by their tyres' width
_FASTEST_MPS = 100.0


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
    up = _unit(windows.force[riding].mean(axis=0))
    yaw = averaged(rate @ up, _SMOOTH_S)
    level = averaged(rate - np.outer(rate @ up, up), _SMOOTH_S)
    forward = -np.gradient(yaw)[riding] @ (level - level.mean(axis=0))[riding]
    forward = _unit(forward - up * (forward @ up))
    left = np.cross(up, forward)
    rolled = _without_drift(np.cumsum(rate @ forward) * WINDOW_S)
    turned = _without_drift(rate @ up)
    _refuse_no_motorcycle(rolled, turned, _without_drift(windows.force @ left), riding)
    known = known_speed(windows.time_s, windows.speed)
    usual = -float(rolled[riding] @ turned[riding] / (turned[riding] @ turned[riding])) * STANDARD_GRAVITY
    if not usual < _FASTEST_MPS:
        raise Refusal("rates-in-radians", usual)
    speed = np.where(np.isnan(known), np.where(riding, usual, 0.0), known)
    slow = np.arctan(-speed * (rate @ up) / STANDARD_GRAVITY)
    lean = rolled + slow - _without_drift(slow)
    _refuse_left_handed(rate @ left, rate @ up, lean, riding)
    return FirstGuess(np.array([left, up, forward]), bias, _borders(lean), _borders(speed))


def _bias(windows: Windows) -> Array:
    """At rest the mean rate; without a standstill the usual one, because most of a ride is nearly straight."""
    for places in (windows.still, windows.calm):
        if np.any(places):
            return np.median(windows.rate[places], axis=0)
    return np.median(averaged(windows.rate, 1.0), axis=0)


def _refuse_no_motorcycle(rolled: Array, turned: Array, sideways: Array, riding: Array) -> None:
    rolled, turned, sideways = rolled[riding], turned[riding], sideways[riding]
    lean = float(np.sqrt(np.mean(rolled**2)))
    likeness = -float(rolled @ turned / np.sqrt(max(float(rolled @ rolled) * float(turned @ turned), 1e-30)))
    pushed = abs(float(sideways @ turned)) / max(abs(float(rolled @ turned)), 1e-30)
    if pushed > _MAX_SIDEWAYS:
        raise Refusal("not-leaning", pushed)
    if lean < _MIN_LEAN or likeness < _MIN_LIKENESS:
        raise Refusal("no-bends", np.degrees(lean))


def _refuse_left_handed(pitch_rate: Array, yaw: Array, lean: Array, riding: Array) -> None:
    """A leaned bike that turns also turns about its own left, by yaw rate x sin(lean), where the axes are right."""
    expected = (yaw * np.sin(lean))[riding]
    share = float((expected - expected.mean()) @ pitch_rate[riding] / (expected @ expected))
    if share < 0.0:
        raise Refusal("left-handed", share)


def _without_drift(values: Array) -> Array:
    slow = averaged(averaged(values, _SLOW_S), _SLOW_S)
    return values - slow


def _borders(values: Array) -> Array:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate((values[:1], inner, values[-1:]))


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
