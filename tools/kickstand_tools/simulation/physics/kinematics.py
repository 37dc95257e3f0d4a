"""Computes exact rates and specific force on a moving rigid body, from its attitude.

Vehicle axes: left, up, forward. The attitude is heading about the vertical, then pitch about the lateral axis, then
lean about the forward axis. So at rest the lean is atan2(left, up) of the specific force.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from .bike import Bike
from .signals import Signal, derivative

_BLOCK = 100_000  # rows computed at a time, to limit memory


@dataclass
class Motion:
    """Motion of the rear contact point and attitude of the chassis, in m/s, rad, rad/s.

    heave: vertical acceleration of the rear of the chassis against the road, m/s^2.
    """

    rate_hz: float
    speed: Signal
    slope: Signal
    yaw_rate: Signal
    lean: Signal
    pitch: Signal  # of the chassis against the horizontal, > 0 nose up
    heave: Signal


def body_rates(motion: Motion) -> NDArray[np.float64]:
    """Rates (n, 3) in rad/s about left, up, forward."""
    lean_rate = derivative(motion.lean, motion.rate_hz)
    pitch_rate = derivative(motion.pitch, motion.rate_hz)
    c, s = np.cos(motion.lean), np.sin(motion.lean)
    level_yaw = motion.yaw_rate * np.cos(motion.pitch)
    return np.column_stack(
        (
            level_yaw * s - pitch_rate * c,  # nose up is a negative rotation about left
            level_yaw * c + pitch_rate * s,
            lean_rate + motion.yaw_rate * np.sin(motion.pitch),
        )
    )


def specific_force(motion: Motion, bike: Bike) -> NDArray[np.float64]:
    """Specific force (n, 3) in m/s^2 along left, up, forward at the sensor: its acceleration minus gravity.

    The body rotates about the centre of the rear tyre's cross-section, a tyre radius above the road.
    """
    rate, v, slope = motion.rate_hz, motion.speed, motion.slope
    left = v * motion.yaw_rate * np.cos(slope)
    up = STANDARD_GRAVITY * np.cos(slope) + v * derivative(slope, rate) + motion.heave
    forward = STANDARD_GRAVITY * np.sin(slope) + derivative(v, rate)
    nose = motion.pitch - slope
    up, forward = (
        up * np.cos(nose) - forward * np.sin(nose),
        forward * np.cos(nose) + up * np.sin(nose),
    )
    c, s = np.cos(motion.lean), np.sin(motion.lean)
    force = np.column_stack((left * c + up * s, up * c - left * s, forward))
    arm = np.array([bike.sensor_left, bike.sensor_height - bike.tyre_radius, bike.sensor_forward])
    rates = body_rates(motion)
    turning = np.gradient(rates, 1.0 / rate, axis=0)
    for start in range(0, len(force), _BLOCK):  # np.cross needs several times the memory of its arguments
        part = slice(start, start + _BLOCK)
        force[part] += np.cross(turning[part], arm)
        force[part] += np.cross(rates[part], np.cross(rates[part], arm))
    return force
