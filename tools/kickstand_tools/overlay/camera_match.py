"""Finds the time of a video in a ride by comparing the magnitudes of the rates of camera and bike.

The magnitude does not depend on the direction in which the camera points.
"""

import numpy as np

from ..common.errors import InputError
from ..joining.motion import STEP_S, BinMotion
from ..signals import Array, correlations, log_likelihood_ratio, moving_mean, peak_offset, peaks
from .video import Telemetry

_SLOW_S = 5.0  # changes of rate that take longer are removed, because they may come from the gyros' bias
_QUICK_S = 0.2  # changes of rate that take less time are removed as vibration, which is different at each place
_ALIKE_S = 0.5  # smallest time between two readings that count as independent
_LEAST_S = 8.0  # shortest part of the video that must be within the ride
_LEAST_EVIDENCE, _LEAST_LEAD, _LEAST_CORRELATION = 15.0, 6.0, 0.5
_APART_S = 2.0


def camera_offset_s(ride: BinMotion, camera: Telemetry) -> tuple[float, float]:
    """Find the ride's time at the video's first picture.

    A camera on the bike turns with the bike. A camera on a helmet also turns with the head, and may not match.

    Returns:
        offset: time of the first picture, in s since the ride's first sample.
        correlation: between the rates of camera and bike at this offset.

    Raises InputError without a match.
    """
    cell = np.floor((camera.t_s - camera.t_s[0]) / STEP_S).astype(int)
    count = np.bincount(cell)
    rate = np.column_stack([np.bincount(cell, axis) for axis in camera.rate_dps.T]) / np.maximum(count, 1)[:, None]
    filmed, ridden = _turning(rate - np.median(rate[count > 0], axis=0)), _turning(ride.rate_dps)
    correlation, common = correlations(ridden, ride.valid, filmed, count > 0)
    correlation = np.where(common * STEP_S >= _LEAST_S, correlation, 0.0)
    likely = log_likelihood_ratio(correlation, common, STEP_S / _ALIKE_S)
    best = peaks(likely, round(_APART_S / STEP_S), 2)
    if not best or likely[best[0]] < _LEAST_EVIDENCE or correlation[best[0]] < _LEAST_CORRELATION:
        raise InputError("at no time does the camera turn like the bike")
    if len(best) > 1 and likely[best[1]] > likely[best[0]] - _LEAST_LEAD:
        raise InputError("the camera turns like the bike at several times")
    index = best[0]
    between = peak_offset(correlation[index - 1 : index + 2]) if 0 < index < len(correlation) - 1 else 0.0
    shift = index - (len(filmed) - 1) + between
    return shift * STEP_S - float(camera.t_s[0]), float(correlation[index])


def _turning(rate_dps: Array) -> Array:
    """Compute the magnitude of the rate, shape (n), and remove its slow and quick changes."""
    size = moving_mean(np.linalg.norm(rate_dps, axis=1), round(_QUICK_S / STEP_S))
    return size - moving_mean(size, round(_SLOW_S / STEP_S))
