"""Computes exact rates and specific force on a moving rigid body, from its attitude.

The vehicle's axes are left, up and forward. The attitude consists of three rotations in this order: heading about the
vertical, pitch about the lateral axis, lean about the forward axis. So at rest the lean is atan2(left, up) of the
specific force.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from numpy.typing import NDArray

from .bike import Bike
from .signals import Signal, derivative

_BLOCK = 100_000  # number of rows that are computed at a time, to limit memory


@dataclass
class Motion:
    """The motion of the rear contact point, and the attitude of the chassis."""

    rate_hz: float  # number of samples per second
    speed: Signal  # speed in m/s
    slope: Signal  # slope of the road, in rad
    yaw_rate: Signal  # rate about the vertical, in rad/s
    lean: Signal  # lean of the chassis, in rad
    pitch: Signal  # pitch of the chassis against the horizontal, in rad, positive if the nose is up
    heave: Signal  # vertical acceleration of the rear of the chassis against the road, in m/s2


def body_rates(motion: Motion) -> NDArray[np.float64]:
    """Compute the rates about left, up and forward, shape (n, 3), in rad/s."""
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
    """Compute the specific force at the sensor along left, up and forward, shape (n, 3), in m/s2.

    The specific force is the sensor's acceleration minus gravity. The body rotates about the centre of the rear tyre's
    cross-section, which is above the road by the radius of this cross-section.
    """
    rate, v, slope = motion.rate_hz, motion.speed, motion.slope
    left = v * motion.yaw_rate * np.cos(slope)
    up = STANDARD_GRAVITY * np.cos(slope) + v * derivative(slope, rate) + motion.heave
    forward = STANDARD_GRAVITY * np.sin(slope) + derivative(v, rate)
    nose = motion.pitch - slope
    up, forward = up * np.cos(nose) - forward * np.sin(nose), forward * np.cos(nose) + up * np.sin(nose)
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
