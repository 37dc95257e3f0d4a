"""Computes forward from all braking and all bends of a mount's logs, with its standard error.

The device keeps eight regression blocks, in which the slope of the road during braking looks like forward. Whole logs
let us filter out the road (see evidence.py). On simulated buses, which brake gently and seldom, this halves the error.
On recorded drives sometimes one and sometimes the other method is better. If the device has an alignment, forward is
the mean of both, weighted by their variances. Up is always the device's.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.drive_alignment.quality import AGREE_DEG, READY_DEG
from kickstand_tools.calibration.drive import UP_DEG, DriveFit
from kickstand_tools.signals import Array, rotation_vector

from . import evidence
from .evidence import Intervals

SENSOR_DEG = 0.3  # standard deviation of forward caused by scale errors of 1 % between the sensor's axes
CORRELATION = 0.5  # between the errors of both methods: they use the same braking
APART_SIGMAS = 2.0  # above this difference of the two methods, forward's standard error grows
# The arm is left out: it only helps to compare parts of a drive. Over a whole drive it absorbs other effects too: with
# it, one of three recorded drives was 2 degrees off; without it, none was off by more than 0.6.
_TERMS = 3
_LEAST_BLOCKS = 4


@dataclass
class Forward:
    """frame (3, 3): vehicle from sensor, rows left, up, forward. sigma_deg: standard error of forward about up;
    attitude_deg: of the whole rotation. halves_deg: difference of forward between two halves of the driving."""

    frame: Array
    sigma_deg: float
    attitude_deg: float
    halves_deg: float

    @property
    def sure(self) -> bool:
        """True if forward is within the limits that the device has."""
        return self.sigma_deg <= READY_DEG and abs(self.halves_deg) <= AGREE_DEG


def find_forward(logs: list[Intervals], device: DriveFit | None = None) -> Forward | None:
    """The alignment by these logs (the intervals of each); None if they do not determine it. device: the firmware's
    alignment by the same logs, None if it has none."""
    whole = evidence.blocks(logs)
    count = len(whole.log)
    if count < _LEAST_BLOCKS:
        return None
    square, product = whole.square[:, :_TERMS, :_TERMS], whole.product[:, :_TERMS]

    def frame_of(part: slice) -> Array:
        return evidence.frames(*evidence.fits(np.sum(square[part], axis=0), np.sum(product[part], axis=0)))

    frame = frame_of(slice(None))
    others = evidence.frames(*evidence.fits(np.sum(square, axis=0) - square, np.sum(product, axis=0) - product))
    off = np.degrees(rotation_vector(others @ frame.T))
    pitch, yaw, roll = (count - 1) / count * np.sum(off * off, axis=0)  # the jackknife: each block left out in turn
    variance = float(yaw) + SENSOR_DEG**2
    apart = float(_yaw_deg(frame_of(slice(count // 2, None)), frame_of(slice(count // 2))))
    if device is not None:
        frame, variance = _mean(frame, variance, device.calibration.vehicle_from_sensor, device.quality_deg)
    attitude = variance + float(pitch + roll) + UP_DEG**2
    return Forward(frame, float(np.sqrt(variance)), float(np.sqrt(attitude)), abs(apart))


def _mean(frame: Array, variance: float, device: Array, quality_deg: float) -> tuple[Array, float]:
    """Up of the device, the weighted mean of both forwards, and its variance (deg^2)."""
    other = quality_deg**2 + SENSOR_DEG**2
    share = variance / (variance + other)
    common = CORRELATION * float(np.sqrt(variance * other))
    apart = float(_yaw_deg(device, frame))
    excess = apart**2 / (variance + other - 2.0 * common) / APART_SIGMAS**2
    mean = (1.0 - share) ** 2 * variance + share**2 * other + 2.0 * share * (1.0 - share) * common
    return evidence.frame_of(device[1], (1.0 - share) * frame[2] + share * device[2]), mean * max(1.0, excess)


def _yaw_deg(frames: Array, before: Array) -> Array:
    """The angle about up between the forwards of frames and of `before`."""
    return np.degrees(rotation_vector(frames @ before.T)[..., 1])
