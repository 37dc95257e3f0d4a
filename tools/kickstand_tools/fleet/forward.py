"""Forward from all braking and all bends of a mount's logs, with its standard error.

The device keeps eight regression blocks, in which the slope of the road during a braking event passes for forward. From
whole logs the road can be filtered out (see evidence.py): on simulated buses, which brake gently and seldom, this
halves the error. Up stays the device's, where it has one.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.drive_alignment.quality import AGREE_DEG, READY_DEG

from ..logs.table import Array
from ..signals.rotations import rotation_vector
from . import evidence
from .evidence import Intervals

SENSOR_DEG = 0.3  # standard deviation of forward by scale errors of 1 % between the sensor's axes
# Without the arm, which is for comparing parts of a drive. Over a whole drive it takes up other effects too: of three
# recorded drives one was 2 degrees off with it, and none over 0.6 without.
_TERMS = 3
_LEAST_BLOCKS = 4


@dataclass
class Forward:
    """frame (3, 3): vehicle from sensor, rows left, up, forward. sigma_deg: standard error of forward about up.
    halves_deg: difference of forward between two halves of the driving."""

    frame: Array
    sigma_deg: float
    halves_deg: float

    @property
    def sure(self) -> bool:
        """True if forward is within the limits that the device has."""
        return self.sigma_deg <= READY_DEG and abs(self.halves_deg) <= AGREE_DEG


def find_forward(logs: list[Intervals], up: Array | None = None) -> Forward | None:
    """The alignment by these logs (the intervals of each); None if they do not determine it. up (3): the vertical in
    the sensor's axes, None to estimate it too."""
    whole = evidence.blocks(logs)
    count = len(whole.log)
    if count < _LEAST_BLOCKS:
        return None
    square, product = whole.square[:, :_TERMS, :_TERMS], whole.product[:, :_TERMS]

    def frame_of(part: slice) -> Array:
        return evidence.frames(*evidence.fits(np.sum(square[part], axis=0), np.sum(product[part], axis=0)))

    frame = frame_of(slice(None))
    others = evidence.frames(*evidence.fits(np.sum(square, axis=0) - square, np.sum(product, axis=0) - product))
    off = _yaw_deg(others, frame)
    variance = (count - 1) / count * float(off @ off)  # the jackknife: each block left out in turn
    apart = float(_yaw_deg(frame_of(slice(count // 2, None)), frame_of(slice(count // 2))))
    if up is not None:
        frame = evidence.frame_of(up, frame[2])
    return Forward(frame, float(np.sqrt(variance + SENSOR_DEG**2)), abs(apart))


def _yaw_deg(frames: Array, before: Array) -> Array:
    """The angle about up between the forwards of frames and of `before`."""
    return np.degrees(rotation_vector(frames @ before.T)[..., 1])
