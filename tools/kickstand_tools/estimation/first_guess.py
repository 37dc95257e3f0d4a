"""Where a bike stands, and its lean and speed, roughly, where the estimation begins. For an alignment also its axes."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from kickstand.errors import Refusal
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..logs.table import Array
from ..signals.leaning import WINDOW_S, Leaning, averaged, leaning_of, speed_in_radians, without_drift
from ..signals.standstill import motionless
from .windows import Windows

STILL_S = 1.6  # shorter standstills look like smooth riding
STILL_RADPS, STILL_G = np.radians(0.35), 0.010  # rms of the means of windows, over STILL_S
BIAS_RADPS = np.radians(4.0)  # of the gyro, since its calibration: a rate above is a turn
MOUNTED_S, MOUNTED_DEG = 10.0, 35.0  # the mean force of a ride over so long keeps within this of up
BETWEEN_S = 20.0
SURELY_S = 4.0  # at both ends of this it may still ride, or fall
SLOW_S = 4.0  # changes of lean that take longer follow from turning, quicker ones from the roll rate
TURNS_S = 40.0  # over which turns give a speed
CALM_S = 1.0
MIN_RIDING_S = 30.0
MIN_LEAN = np.radians(3.0)  # rms: riding straight on shows nothing
MIN_LIKENESS = 0.5  # correlation between leaning and turning; bikes have over 0.75
MAX_PUSHED = 0.5  # force to the side over the lean in bends; bikes have 0.1 to 0.2 by their tyres' width
CAR_G, CAR_LEAN = 0.045, np.radians(5.0)  # a car's rms of the force to the side is above, of its lean below
STUCK_MPS = 0.5
MAX_SPEED_FACTOR = 1.8  # of the log's speed and that of the bends, in either direction
USUAL_MPS, USUAL_RADPS = 10.0, 0.14  # where there are no turns; yaw rate of turns that count as much


def standing(w: Windows) -> NDArray[np.bool_]:
    """(n) True where the bike stands still: nothing changes, and no speed speaks against it. For zero-velocity updates.
    The rates of w have at most a small bias."""
    return _calm(w, STILL_S) & (np.linalg.norm(averaged(w.rate, STILL_S), axis=1) < BIAS_RADPS)


def _calm(w: Windows, over_s: float) -> NDArray[np.bool_]:
    return ~w.gap & motionless(
        w.rate, w.force, 2 * round(0.5 * over_s / WINDOW_S) + 1, STILL_RADPS, STILL_G, w.known_speed
    )


def in_hand(w: Windows) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n) True where the sensor is surely moved about in a hand, or lies with the bike: up is far from where it was.
    And the same with the seconds before and after, which may not be riding either.

    On a bike in balance the force is along its own up, however far it leans.
    """
    there = ~w.gap
    mean = averaged(w.force * there[:, None], MOUNTED_S)
    off = there & (mean[:, 1] < np.cos(np.radians(MOUNTED_DEG)) * np.linalg.norm(mean, axis=1))
    places = np.flatnonzero(off)
    if len(places):  # between two of them, and between one and an end of the log, it need not be mounted
        ends = np.concatenate(([0], places, [len(w) - 1]))
        for begin, end in itertools.pairwise(ends):
            if w.edges[end + 1] - w.edges[begin] < BETWEEN_S:
                off[begin : end + 1] = True
    share = off.astype(float)
    return averaged(share, SURELY_S) > 0.99, averaged(share, MOUNTED_S) > 0.01


def lean_and_speed(w: Windows, still: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Lean (n, rad) and speed (n, m/s). still (n): of standing().

    Without a speed in the log it is the one at which turns have the forces that they have: in balance 1 / cos(lean) is
    the force, and speed x yaw rate = g tan(lean).
    """
    known, yaw = w.known_speed, w.rate[:, 1]
    force = averaged(np.linalg.norm(w.force[:, :2], axis=1), 2.0)
    steep = np.tan(np.arccos(np.clip(1.0 / np.maximum(force, 0.1), 0.3, 1.0)))
    turning = np.abs(averaged(yaw, 1.0))
    both = averaged(steep * turning, TURNS_S) * STANDARD_GRAVITY + USUAL_RADPS**2 * USUAL_MPS
    speed = np.clip(both / (averaged(turning**2, TURNS_S) + USUAL_RADPS**2), 3.0, 50.0)
    speed = np.where(still, 0.0, np.where(np.isnan(known), speed, known))
    slow = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    slow = np.where(still, np.arctan2(w.force[:, 0], w.force[:, 1]), slow)
    rolled = np.cumsum(w.rate[:, 2] * w.seconds)
    return np.clip(rolled - averaged(averaged(rolled - slow, SLOW_S), SLOW_S), -1.3, 1.3), speed


@dataclass
class Axes:
    """matrix (3, 3): vehicle from sensor, rows left, up, forward. bias (3): of the gyro, rad/s, sensor's axes."""

    matrix: Array
    bias: Array


def axes(w: Windows) -> Axes:
    """Where up and forward are, within some degrees, and the gyro's bias, of windows along the sensor's axes.

    In balance the specific force keeps the direction of the bike's own up, so that its mean over the riding is up. For
    forward, and for the hand of the axes, see signals/leaning.py. Raises Refusal where the ride is none of a
    motorcycle, or has too little leaning.
    """
    bias = _bias(w)
    w = replace(w, rate=w.rate - bias)
    riding = ~w.gap & ~standing(w)
    seconds = float(np.sum(w.seconds[riding]))
    if seconds < MIN_RIDING_S:
        raise Refusal("ride-short", seconds, MIN_RIDING_S)
    found = leaning_of(w.rate, w.force, riding)
    _refuse_no_motorcycle(found, without_drift(w.force @ found.matrix[0]), riding)
    _refuse_wrong_speed(w.known_speed[riding], found.rolled[riding], found.turned[riding])
    return Axes(found.matrix, bias)


def _bias(w: Windows) -> Array:
    """At rest the mean rate; without a standstill that of smooth riding, else the usual one, because most of a ride is
    nearly straight."""
    for over_s in (STILL_S, CALM_S):
        places = _calm(w, over_s)
        if np.any(places):
            return np.median(w.rate[places], axis=0)
    return np.median(averaged(w.rate, CALM_S), axis=0)


def _refuse_no_motorcycle(found: Leaning, sideways: Array, riding: NDArray[np.bool_]) -> None:
    """sideways (n): force to the left, g, changes within some seconds only."""
    in_radians_mps = speed_in_radians(found)
    if in_radians_mps is not None:
        raise Refusal("rates-in-radians", in_radians_mps)
    rolled, turned, sideways = found.rolled[riding], found.turned[riding], sideways[riding]
    lean, side = float(np.sqrt(np.mean(rolled**2))), float(np.sqrt(np.mean(sideways**2)))
    pushed = abs(float(sideways @ turned)) / max(abs(float(rolled @ turned)), 1e-30)
    if pushed > MAX_PUSHED and side > CAR_G and lean < CAR_LEAN:
        raise Refusal("not-leaning")
    if lean < MIN_LEAN:
        raise Refusal("no-bends", float(np.degrees(lean)))
    if pushed > MAX_PUSHED or found.likeness < MIN_LIKENESS:
        raise Refusal("ride-contradicts")
    # a leaned bike that turns also turns about its own left
    if found.share < 0.0:
        raise Refusal("left-handed")


def _refuse_wrong_speed(known: Array, rolled: Array, turned: Array) -> None:
    """known: m/s, NaN if unknown. The speed of the bends is the one whose yaw rates go with the lean."""
    if not len(known) or np.isnan(known[0]):
        return
    if np.ptp(known) < STUCK_MPS:
        raise Refusal("speed-stuck", float(known[0]))
    expected = known * turned
    both = -float(expected @ rolled) * STANDARD_GRAVITY
    factor = float(expected @ expected) / both if both > 0.0 else 0.0
    if not 1.0 / MAX_SPEED_FACTOR < factor < MAX_SPEED_FACTOR:
        raise Refusal("speed-unit", factor)
