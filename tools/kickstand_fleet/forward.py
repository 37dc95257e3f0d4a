"""Computes forward, with its standard error, from all braking and all bends in the logs of one mount.

The firmware's regression cannot separate the slope of the road during braking from an error of forward. This module
uses whole logs, from which the slope can be filtered out (see evidence.py). The filter halves the error on simulated
buses, which brake gently and seldom. On recorded drives, neither method is always better. If the firmware finds an
alignment, forward is therefore the mean of both results, weighted by their variances. The direction up is then always
the firmware's.
"""

from dataclasses import dataclass

import numpy as np
from kickstand.drive_alignment.quality import AGREE_DEG, READY_DEG
from kickstand_tools.calibration.drive import UP_DEG, DriveFit
from kickstand_tools.signals import Array, rotation_vector

from . import evidence
from .evidence import Intervals

SENSOR_DEG = 0.3  # standard error of forward, in degrees, caused by a scale difference of 1 % between the sensor's axes
# Correlation between the errors of the firmware's and this module's forward, which use the same braking
CORRELATION = 0.5
# Largest difference between the two methods, in standard deviations, that does not increase the standard error of
# forward
APART_SIGMAS = 2.0
# Number of coefficients of evidence.py that are fitted: level, forward and left. The fourth coefficient, arm, is useful
# only to compare parts of a drive. When arm was fitted to whole drives, forward was wrong by 2 degrees in one of three
# recorded drives. Without arm, the error was at most 0.6 degrees in all three drives.
_TERMS = 3
_LEAST_BLOCKS = 4


@dataclass
class Forward:
    """The alignment of a mount."""

    frame: Array  # rotation from sensor to vehicle axes, shape (3, 3). Its rows are left, up, forward.
    sigma_deg: float  # standard error of forward about up
    attitude_deg: float  # standard error of the whole rotation
    halves_deg: float  # angle between forward from the first half of the driving and forward from the second half

    @property
    def sure(self) -> bool:
        """True if the errors of forward are within the firmware's limits."""
        return self.sigma_deg <= READY_DEG and abs(self.halves_deg) <= AGREE_DEG


def find_forward(logs: list[Intervals], device: DriveFit | None = None) -> Forward | None:
    """Compute the alignment from all logs. Returns None if the logs do not determine it.

    A short drive has too few blocks for this module's alignment. The result is then the firmware's alignment.

    logs: The intervals of each log.
    device: The firmware's alignment from the same logs, or None if the firmware refuses them.
    """
    driving = evidence.blocks(logs)
    count = len(driving.log)
    if count < _LEAST_BLOCKS:
        return _alone(device) if device else None
    square, product = driving.square[:, :_TERMS, :_TERMS], driving.product[:, :_TERMS]

    def frame_of(part: slice) -> Array:
        return evidence.frames(*evidence.fits(np.sum(square[part], axis=0), np.sum(product[part], axis=0)))

    frame = frame_of(slice(None))
    partial_frames = evidence.frames(*evidence.fits(np.sum(square, axis=0) - square, np.sum(product, axis=0) - product))
    deviation_deg = np.degrees(rotation_vector(partial_frames @ frame.T))
    # Jackknife: compute the alignment without each block in turn. The variance comes from the differences of these
    # alignments
    pitch, yaw, roll = (count - 1) / count * np.sum(deviation_deg * deviation_deg, axis=0)
    variance = float(yaw) + SENSOR_DEG**2
    halves_deg = float(_yaw_deg(frame_of(slice(count // 2, None)), frame_of(slice(count // 2))))
    if device is not None:
        frame, variance = _mean(frame, variance, device.calibration.vehicle_from_sensor, device.quality_deg)
    attitude = variance + float(pitch + roll) + UP_DEG**2
    return Forward(frame, float(np.sqrt(variance)), float(np.sqrt(attitude)), abs(halves_deg))


def _alone(device: DriveFit) -> Forward:
    """Return the firmware's alignment with its standard errors."""
    sigma = float(np.hypot(device.quality_deg, SENSOR_DEG))
    attitude = float(np.hypot(sigma, UP_DEG))
    return Forward(device.calibration.vehicle_from_sensor, sigma, attitude, device.halves_deg or 0.0)


def _mean(frame: Array, variance: float, device: Array, quality_deg: float) -> tuple[Array, float]:
    """Merge this module's alignment with the firmware's.

    Args:
        frame: This module's alignment, shape (3, 3).
        variance: Variance of its forward, in deg^2.
        device: The firmware's alignment, shape (3, 3).
        quality_deg: Standard error of its forward, in degrees.

    Returns:
        merged: the alignment with the firmware's up and the weighted mean of both forwards, shape (3, 3).
        variance: variance of the mean, in deg^2.
    """
    device_variance = quality_deg**2 + SENSOR_DEG**2
    share = variance / (variance + device_variance)
    common = CORRELATION * float(np.sqrt(variance * device_variance))
    difference_deg = float(_yaw_deg(device, frame))
    excess = difference_deg**2 / (variance + device_variance - 2.0 * common) / APART_SIGMAS**2
    mean = (1.0 - share) ** 2 * variance + share**2 * device_variance + 2.0 * share * (1.0 - share) * common
    return evidence.frame_of(device[1], (1.0 - share) * frame[2] + share * device[2]), mean * max(1.0, excess)


def _yaw_deg(frames: Array, reference: Array) -> Array:
    """Compute the angle about up, in degrees, from the alignment `before` to each alignment in frames."""
    return np.degrees(rotation_vector(frames @ reference.T)[..., 1])
