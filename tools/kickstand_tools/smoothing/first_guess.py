"""Where a bike stands, and its lean and speed, roughly: where the adjustment begins."""

import itertools

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from ..calibration.ride.windows import known_speed
from ..logs.axes.leaning import averaged, unrest
from ..logs.table import Array
from .windows import Windows

STILL_S = 1.6  # shorter standstills are not told from smooth riding
STILL_RADPS, STILL_G = np.radians(0.35), 0.010  # rms of the means of windows, over STILL_S
STILL_MPS, STANDS = 0.3, 4.0  # a speed of less allows so much more
BIAS_RADPS = np.radians(4.0)  # of the gyro, since its calibration: a rate above is a turn
MOUNTED_S, MOUNTED_DEG = 10.0, 35.0  # the mean force of a ride over so long keeps within this of up
BETWEEN_S = 20.0
SURELY_S = 4.0  # at both ends of this it may still ride, or fall
SLOW_S = 4.0  # changes of lean that take longer follow from turning, quicker ones from the roll rate
TURNS_S = 40.0  # over which turns tell a speed
USUAL_MPS, USUAL_RADPS = 10.0, 0.14  # where there are no turns; yaw rate of turns that count as much


def standing(w: Windows) -> NDArray[np.bool_]:
    """(n) True where the bike stands still: nothing changes, and no speed speaks against it."""
    known = _known(w)
    allowed = np.where(known < STILL_MPS, STANDS, 1.0)
    calm = (unrest(w.rate, STILL_S) < allowed * STILL_RADPS) & (unrest(w.force, STILL_S) < allowed * STILL_G)
    calm &= np.linalg.norm(averaged(w.rate, STILL_S), axis=1) < BIAS_RADPS
    return calm & ~w.gap & ~(known >= STILL_MPS)


def in_hand(w: Windows) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n) True where the sensor is surely moved about in a hand, or lies with the bike: up is far from where it was.
    And the same with the seconds before and after, which may not be riding either.

    A bike in balance feels the force along its own up, however far it leans.
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


def first_guess(w: Windows, still: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Lean (n, rad) and speed (n, m/s). still (n): of standing().

    Without a speed in the log it is the one at which turns have the forces that they have: in balance 1 / cos(lean) is
    the force, and speed x yaw rate = g tan(lean).
    """
    known, yaw = _known(w), w.rate[:, 1]
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


def _known(w: Windows) -> Array:
    return known_speed(0.5 * (w.edges[1:] + w.edges[:-1]), w.speed)
