"""Computes the values that the gauge shows at each moment of a ride."""

from dataclasses import dataclass

import numpy as np

from ..analysis.ride import RideReading
from ..analysis.summary import HELD_S
from ..signals import Array, Ints, smoothed

_FORCE_S = 0.3  # averaging time of the forces, because engine and road shake the sensor
_GAP_S = 0.2  # longest gap between readings over which values are interpolated
_SPEED_S = 3.0  # longest gap between speeds over which the speed is interpolated; most receivers send one per second


@dataclass
class Shown:
    """The values at n moments of a ride. Values that are unknown or not trusted are NaN.

    t_s: time in s since the ride's first sample.
    lean_deg: lean, positive to the right.
    forward_g: forward acceleration, positive when speeding up.
    left_g: acceleration to the left, parallel to the road.
    speed_mps: speed.
    left_deg, right_deg: the largest lean to each side so far, 0 for none.
    """

    t_s: Array
    lean_deg: Array
    forward_g: Array
    left_g: Array
    speed_mps: Array
    left_deg: Array
    right_deg: Array

    @property
    def has_speed(self) -> bool:
        """True if there is a speed at any moment."""
        return bool(np.any(np.isfinite(self.speed_mps)))

    @property
    def values(self) -> tuple[Array, ...]:
        """All values except the times, each of shape (n)."""
        return self.lean_deg, self.forward_g, self.left_g, self.speed_mps, self.left_deg, self.right_deg

    def at(self, t_s: Array) -> "Shown":
        """Interpolate the values at other times. The values are NaN before the ride, after it and in gaps."""
        index = np.clip(np.searchsorted(self.t_s, t_s, side="right") - 1, 0, len(self.t_s) - 2)
        lean, forward, left = (
            _along_lines(self.t_s, value, index, t_s, _GAP_S) for value in (self.lean_deg, self.forward_g, self.left_g)
        )
        valid = np.flatnonzero(np.isfinite(self.speed_mps))
        speed = np.full(len(t_s), np.nan)
        if len(valid) > 1:
            at_s = self.t_s[valid]
            speed_index = np.clip(np.searchsorted(at_s, t_s, side="right") - 1, 0, len(valid) - 2)
            speed = _along_lines(at_s, self.speed_mps[valid], speed_index, t_s, _SPEED_S)
        last = np.searchsorted(self.t_s, t_s, side="right") - 1
        most_left, most_right = (np.where(last >= 0, value[last], 0.0) for value in (self.left_deg, self.right_deg))
        return Shown(t_s, lean, forward, left, speed, most_left, most_right)


def shown(reading: RideReading) -> Shown:
    """Compute the values of a ride. open_ride() has selected the live or the smoothed lean. Raises InputError."""
    columns: list[Array] = []
    for part in reading.parts():
        lean = np.where(part.trusted, part.lean_deg, np.nan)
        columns.append(np.array([part.t_s, lean, part.forward_g, part.lateral_g, part.speed_mps]))
    t_s, lean, forward, left, speed = np.hstack(columns)
    forward, left = (smoothed(values, t_s, _FORCE_S) for values in (forward, left))
    return Shown(t_s, lean, forward, left, speed, _maximum(t_s, -lean), _maximum(t_s, lean))


def _maximum(t_s: Array, lean: Array) -> Array:
    """Find the largest lean up to each moment that lasted at least HELD_S, shape (n). The result is 0 without such a
    lean."""
    count = round(HELD_S / float(np.median(np.diff(t_s)))) + 1
    value = np.where(np.isfinite(lean), lean, 0.0)
    padded = np.append(np.zeros(count - 1), value)
    lasted = np.min(np.lib.stride_tricks.sliding_window_view(padded, count), axis=1)
    return np.maximum(np.maximum.accumulate(lasted), 0.0)


def _along_lines(at_s: Array, values: Array, index: Ints, t_s: Array, gap_s: float) -> Array:
    """Interpolate linearly. NaN outside the values, and between values further apart than gap_s. index: the value
    before.
    """
    step_s = at_s[index + 1] - at_s[index]
    share = (t_s - at_s[index]) / step_s
    result = values[index] * (1.0 - share) + values[index + 1] * share
    margin = gap_s / step_s
    inside = (share >= -np.minimum(margin, 0.5)) & (share <= 1.0 + np.minimum(margin, 0.5)) & (step_s <= gap_s)
    return np.where(inside, result, np.nan)
