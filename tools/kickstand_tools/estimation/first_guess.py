"""Finds the starting point of the estimation: standstills, rough lean and speed and, for an alignment, rough axes."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from kickstand.units import STANDARD_GRAVITY

from ..checks.axes import RatesInRadians
from ..checks.log import SpeedStuck, SpeedUnit
from ..checks.turning import bias_dps
from ..common.messages import RefusedInput, Remedy, kind
from ..signals import Array, Bools, motionless
from ..signals.leaning import WINDOW_S, Leaning, averaged, leaning_of, speed_in_radians, without_drift
from .windows import Windows

STILL_S = 1.6  # least length of a standstill; a shorter standstill looks like smooth riding
STILL_RADPS, STILL_G = np.radians(0.35), 0.010  # largest standard deviations over STILL_S on a standing bike
BIAS_RADPS = np.radians(4.0)  # largest bias of the gyro since its calibration; a higher mean rate is a bend
MOUNTED_S, MOUNTED_DEG = 10.0, 35.0  # largest angle between up and the mean force over MOUNTED_S, for a mounted sensor
BETWEEN_S = 20.0  # a shorter time between two movements in a hand also counts as time in the hand
SURELY_S = 4.0  # a movement longer than this is certainly in a hand; a shorter movement may be riding or a fall
SLOW_S = 4.0  # changes of lean slower than this are computed from the yaw rate, faster changes from the roll rate
TURNS_S = 40.0  # the speed is computed from the bends within this time
MIN_RIDING_S = 30.0
MIN_LEAN = np.radians(3.0)  # a ride whose lean has a smaller rms does not show forward
MIN_CORRELATION = 0.5  # least correlation between leaning and turning; bikes have over 0.75
# Largest force to the side in bends, divided by the lean. Bikes have 0.1 to 0.2, due to the width of the tyres.
MAX_PUSHED = 0.5
# A car has a larger rms of the force to the side, also divided by the lean, and a smaller rms of lean. The rates are
# about the force: in recorded drives the angle was at most 16 degrees. A leaning bike's rates are not, even in a bend
# that is so long that the lean hardly changes. In less than CAR_S, the force to the side must also fit the yaw rate.
CAR_G, CAR_PUSHED, CAR_LEAN, CAR_TILT = 0.045, 2.0, np.radians(5.0), np.radians(20.0)
CAR_S, CAR_CORRELATION = 60.0, 0.35
CONTRADICTS_S = 120.0  # less riding that no mounting explains is only not enough
# A log's speed is stuck if it changes by less than STUCK_MPS, although the force along the vehicle changes the speed by
# an rms of PUSHED_MPS.
STUCK_MPS, PUSHED_MPS = 0.5, 1.5
MAX_SPEED_FACTOR = 1.8  # largest factor between the log's speed and the speed from the bends
# The prior of the speed from the bends is USUAL_MPS. The prior has the weight of bends with the yaw rate USUAL_RADPS.
USUAL_MPS, USUAL_RADPS = 10.0, 0.14


RideShort = kind(
    "ride-short",
    "riding_s least_s",
    "only {riding_s:.0f} s of riding",
    Remedy("at least {least_s:.0f} s with bends are needed"),
)
NoBends = kind(
    "no-bends",
    "lean_deg",
    "it hardly leans ({lean_deg:.1f} degrees rms)",
    Remedy("a motorcycle's ride with bends to both sides is needed"),
)
NotLeaning = kind(
    "not-leaning",
    text="in bends it is pushed aside and does not lean, as a car",
    todo=Remedy(
        "with a speed in the log take kickstand calibrate drive --vehicle car", "this page aligns motorcycles only"
    ),
)
# A long bend to one side looks the same if it is mirrored
SideUnsure = kind(
    "side-unsure",
    text="it does not show to which side the bike leans in the bends",
    todo=Remedy("a ride with straights between bends to both sides is needed"),
)
RideContradicts = kind(
    "ride-contradicts",
    text="no one mounting explains these readings",
    todo=Remedy("was the sensor moved, or are axes exchanged between accelerometer and gyro?"),
)


def standing(w: Windows) -> Bools:
    """Find the windows in which the bike stands still, for zero-velocity updates.

    Rates and forces do not change, the mean rate is under BIAS_RADPS, and the speed, if known, agrees.

    Returns True where the bike stands, shape (n).
    """
    return _calm(w, STILL_S) & (np.linalg.norm(averaged(w.rate, STILL_S), axis=1) < BIAS_RADPS)


def _calm(w: Windows, over_s: float) -> Bools:
    count = 2 * round(0.5 * over_s / WINDOW_S) + 1
    return ~w.gap & motionless(w.rate, w.force, count, STILL_RADPS, STILL_G, w.known_speed)


def in_hand(w: Windows) -> tuple[Bools, Bools]:
    """Find the windows in which a hand moves the sensor, or in which the bike has fallen.

    In these windows, up is far from its usual direction. On a balanced bike, the force points along the bike's own up
    at any lean.

    Returns:
        surely: True where a hand certainly moves the sensor, or the bike has fallen, shape (n).
        perhaps: the same, but also True in the seconds around these windows, because the bike may not be riding there.
    """
    valid = ~w.gap
    mean = averaged(w.force * valid[:, None], MOUNTED_S)
    tilted = valid & (mean[:, 1] < np.cos(np.radians(MOUNTED_DEG)) * np.linalg.norm(mean, axis=1))
    moved = np.flatnonzero(tilted)
    # If the time between two movements in a hand is short, the sensor was perhaps in the hand all this time. The same
    # holds for the time from the beginning of the log to the first movement, and from the last movement to the end.
    if len(moved):
        ends = np.concatenate(([0], moved, [len(w) - 1]))
        for begin, end in itertools.pairwise(ends):
            if w.edges[end + 1] - w.edges[begin] < BETWEEN_S:
                tilted[begin : end + 1] = True
    share = tilted.astype(float)
    return averaged(share, SURELY_S) > 0.99, averaged(share, MOUNTED_S) > 0.01


def lean_and_speed(w: Windows, still: Bools) -> tuple[Array, Array]:
    """Approximate the lean and the speed in n windows.

    If the log has no speed, the bends give it. In balance, the force is 1 / cos(lean) in g, and speed x yaw rate =
    g tan(lean).

    still: see standing(), shape (n).
    Returns:
        lean: shape (n), in rad.
        speed: shape (n), in m/s.
    """
    log_speed, yaw = w.known_speed, w.rate[:, 1]
    force = averaged(np.linalg.norm(w.force[:, :2], axis=1), 2.0)
    steep = np.tan(np.arccos(np.clip(1.0 / np.maximum(force, 0.1), 0.3, 1.0)))
    turning = np.abs(averaged(yaw, 1.0))
    weighted = averaged(steep * turning, TURNS_S) * STANDARD_GRAVITY + USUAL_RADPS**2 * USUAL_MPS
    speed = np.clip(weighted / (averaged(turning**2, TURNS_S) + USUAL_RADPS**2), 3.0, 50.0)
    speed = np.where(still, 0.0, np.where(np.isnan(log_speed), speed, log_speed))
    slow = np.arctan(-speed * yaw / STANDARD_GRAVITY)
    slow = np.where(still, np.arctan2(w.force[:, 0], w.force[:, 1]), slow)
    rolled = np.cumsum(w.rate[:, 2] * w.seconds)
    return np.clip(rolled - averaged(averaged(rolled - slow, SLOW_S), SLOW_S), -1.3, 1.3), speed


@dataclass
class Axes:
    """The vehicle's axes and the gyro's bias.

    matrix: rotation from sensor to vehicle axes, shape (3, 3). The rows are left, up and forward.
    bias: the gyro's bias along the sensor's axes, shape (3), in rad/s.
    """

    matrix: Array
    bias: Array


def axes(w: Windows) -> Axes:
    """Find the vehicle's axes, within some degrees, and the gyro's bias.

    In balance, the specific force points along the bike's own up, so the mean force while riding shows "up". For
    forward and the handedness see signals/leaning.py.

    w: windows along the sensor's axes.
    Raises RefusedInput if the ride is not a motorcycle's, or has too little lean.
    """
    bias = _bias(w)
    w = replace(w, rate=w.rate - bias)
    riding = ~w.gap & ~standing(w)
    seconds = float(np.sum(w.seconds[riding]))
    if seconds < MIN_RIDING_S:
        raise RefusedInput(RideShort(seconds, MIN_RIDING_S))
    leaning = leaning_of(w.rate, w.force, riding)
    _refuse_no_motorcycle(leaning, without_drift(w.force @ leaning.matrix[0]), _tilt(w, riding), riding)
    pushed = without_drift(np.cumsum(w.force @ leaning.matrix[2]) * WINDOW_S * STANDARD_GRAVITY)
    _refuse_wrong_speed(w.known_speed[riding], leaning.rolled[riding], leaning.turned[riding], pushed[riding])
    return Axes(leaning.matrix, bias)


def _bias(w: Windows) -> Array:
    """Return the gyro's bias, shape (3), in rad/s: the median rate at rest.

    Without a standstill it is the bias with which the rates explain the forces best. The median rate may be that of a
    long bend, so it is used for short rides only.
    """
    calm = _calm(w, STILL_S)
    if np.any(calm):
        return np.median(w.rate[calm], axis=0)
    fitted = bias_dps(w.force, np.degrees(w.rate), ~w.gap, WINDOW_S)
    return np.median(w.rate[~w.gap], axis=0) if fitted is None else np.radians(fitted)


def _tilt(w: Windows, riding: Bools) -> float:
    """Return the usual angle between force and rate while riding, in rad."""
    force, rate = averaged(w.force, 2.0)[riding], averaged(w.rate, 2.0)[riding]
    return float(np.arctan2(np.linalg.norm(np.cross(force, rate)), np.linalg.norm(np.sum(force * rate, axis=1))))


def _refuse_no_motorcycle(found: Leaning, sideways: Array, tilt: float, riding: Bools) -> None:
    """Raise RefusedInput if the ride is not a motorcycle's, or does not show lean and side.

    sideways: the force to the left without its slow changes, shape (n), in g.
    tilt: see _tilt().
    """
    in_radians_mps = speed_in_radians(found)
    if in_radians_mps is not None:
        raise RefusedInput(RatesInRadians(in_radians_mps))
    rolled, turned, sideways = found.rolled[riding], found.turned[riding], sideways[riding]
    lean, side = float(np.sqrt(np.mean(rolled**2))), float(np.sqrt(np.mean(sideways**2)))
    pushed = abs(float(sideways @ turned)) / max(abs(float(rolled @ turned)), 1e-30)
    correlation = abs(float(sideways @ turned)) / max(float(np.linalg.norm(sideways) * np.linalg.norm(turned)), 1e-30)
    car = pushed > CAR_PUSHED and side > CAR_G and lean < CAR_LEAN and tilt < CAR_TILT
    riding_s = np.count_nonzero(riding) * WINDOW_S
    if car and (correlation > CAR_CORRELATION or riding_s > CAR_S):
        raise RefusedInput(NotLeaning())
    if lean < MIN_LEAN:
        raise RefusedInput(NoBends(float(np.degrees(lean))))
    if pushed > MAX_PUSHED or found.correlation < MIN_CORRELATION:
        raise RefusedInput(RideContradicts() if riding_s > CONTRADICTS_S else SideUnsure())
    # A leaning bike that turns also rotates about its own left. The opposite sign of this rotation contradicts the side
    # of the lean. The handedness itself is judged when the log is read.
    if found.share < 0.0:
        raise RefusedInput(SideUnsure())


def _refuse_wrong_speed(known: Array, rolled: Array, turned: Array, pushed: Array) -> None:
    """Raise RefusedInput if the log's speed is stuck or not in m/s.

    The log's speed is compared with the speed at which yaw rate and lean balance in the bends.

    known: the log's speed, in m/s; NaN without a speed.
    pushed: the changes of speed by the force along the vehicle, in m/s.
    """
    if not len(known) or np.isnan(known[0]):
        return
    if np.ptp(known) < STUCK_MPS and np.std(pushed) > PUSHED_MPS:
        raise RefusedInput(SpeedStuck(float(known[0])))
    expected = known * turned
    balance = -float(expected @ rolled) * STANDARD_GRAVITY
    factor = float(expected @ expected) / balance if balance > 0.0 else 0.0
    if not 1.0 / MAX_SPEED_FACTOR < factor < MAX_SPEED_FACTOR:
        raise RefusedInput(SpeedUnit(factor))
