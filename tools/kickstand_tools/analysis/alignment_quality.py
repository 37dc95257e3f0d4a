"""Estimates from a ride how far the aligned axes are from the bike's own axes.

* roll: on a straight, a balanced bike is upright, so the mean force points along the bike's own up axis.
* yaw: on a straight, braking and speeding up push along the bike's own forward axis.
* pitch: between two standstills on level ground, speeding up and braking cancel out. The remaining mean forward force
  shows the pitch error.
* gravity: at standstill, the force must be 1 g.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.lean.kalman import MAX_TRIM

from ..signals import Array, Bools
from .channels import Channels, spacing_s

# Each error of the axes causes an error of the shown lean, measured with simulated rides and rotated calibrations.
# * With a yaw error, pitching looks like rolling: measured roll rate = roll rate cos(yaw) + pitch rate sin(yaw). The
#   error of the lean is then the bike's pitching times sin(yaw).
# * With a pitch error, yawing looks like rolling in the same way, but the filter corrects most of this error.
# * A roll error adds to the lean, but the filter corrects up to MAX_TRIM of it while riding.
YAW_COSTS_DEG, PITCH_COSTS_DEG = 3.0, 5.0  # rms error of the lean, divided by the sine of the angle

SMOOTH_S = 0.5
STRAIGHT_DPS, STRAIGHT_DEG = 2.0, 8.0  # largest yaw rate and largest lean on a straight
ENOUGH_S = 10.0  # a shorter time of straight riding does not show roll and yaw
LEVEL_S = 60.0  # in a longer time of riding, uphill and downhill roughly cancel out
ENOUGH_G = 0.05  # a smaller standard deviation of the forward force on straights does not show yaw


@dataclass
class Quality:
    """Angles by which the aligned axes seem to be off. An angle is None if the ride does not show it.

    roll_deg: positive if the aligned up axis leans to the right of the bike's own up.
    pitch_deg: positive if the aligned forward axis points up.
    yaw_deg: positive if the aligned forward axis points to the right of the direction in which the bike speeds up.
    gravity_g: mean force at rest; None without a standstill.
    straight_s: seconds of straight riding, which show roll and yaw.
    lateral_g, forward_g: forces during straight riding, averaged over SMOOTH_S.
    """

    roll_deg: float | None
    pitch_deg: float | None
    yaw_deg: float | None
    gravity_g: float | None
    straight_s: float
    lateral_g: Array
    forward_g: Array


@dataclass
class LeanCost:
    """The approximate rms error of the shown lean, in degrees, that each angle causes. None for an unknown angle."""

    roll_deg: float | None
    pitch_deg: float | None
    yaw_deg: float | None


def lean_cost(quality: Quality) -> LeanCost:
    """Return the errors of a motorcycle's shown lean that these errors of the axes cause.

    >>> cost = lean_cost(Quality(0.2, None, 5.1, 1.0, 60.0, np.zeros(1), np.zeros(1)))
    >>> cost.roll_deg, cost.pitch_deg, round(cost.yaw_deg, 2)
    (0.0, None, 0.27)
    """

    roll, pitch, yaw = quality.roll_deg, quality.pitch_deg, quality.yaw_deg
    return LeanCost(
        None if roll is None else max(0.0, abs(roll) - float(np.degrees(MAX_TRIM))),
        None if pitch is None else PITCH_COSTS_DEG * abs(float(np.sin(np.radians(pitch)))),
        None if yaw is None else yaw_cost_deg(yaw),
    )


def yaw_cost_deg(yaw_deg: float) -> float:
    """Return the average rms error of the shown lean that a yaw error of the alignment causes, in degrees."""
    return YAW_COSTS_DEG * abs(float(np.sin(np.radians(yaw_deg))))


def quality(ride: Channels, standing: Bools) -> Quality:
    """Compute the Quality from a whole ride.

    ride: evenly spaced samples (see downsampled()).
    standing: True where the vehicle stands still, shape (n).
    """
    step_s = spacing_s(ride)
    n = min(max(1, round(SMOOTH_S / step_s)), len(ride.t_s))
    count = len(ride.t_s) // n

    def means(values: Array) -> Array:
        return np.mean(values[: count * n].reshape(count, n), axis=1)

    left, up, forward = means(ride.left_g), means(ride.up_g), means(ride.forward_g)
    lateral, yaw_rate = means(ride.lateral_g), means(ride.yaw_rate_dps)
    moving = means(standing.astype(float)) == 0.0
    still = means(standing.astype(float)) == 1.0
    static = np.degrees(np.arctan2(left, up))
    not_turning = moving & (np.abs(yaw_rate) < STRAIGHT_DPS)
    usual = float(np.median(static[not_turning])) if np.any(not_turning) else 0.0  # measured lean of an upright bike
    straight = not_turning & (np.abs(static - usual) < STRAIGHT_DEG)
    straight_s = float(np.count_nonzero(straight)) * n * step_s
    roll = pitch = yaw = None
    if straight_s >= ENOUGH_S:
        roll = float(np.mean(static[straight]))
        push = forward[straight] - np.mean(forward[straight])
        if np.std(push) > ENOUGH_G:
            yaw = float(np.degrees(np.arctan(np.mean(push * left[straight]) / np.mean(push * push))))
    if standing[0] and standing[-1] and np.count_nonzero(moving) * n * step_s > LEVEL_S:
        push = float(np.mean(forward[moving]))
        pitch = float(np.degrees(np.arcsin(push))) if abs(push) < 1.0 else None
    sizes = np.sqrt(left * left + up * up + forward * forward)[still]
    gravity = float(np.mean(sizes)) if len(sizes) else None
    return Quality(roll, pitch, yaw, gravity, straight_s, lateral[straight], forward[straight])
