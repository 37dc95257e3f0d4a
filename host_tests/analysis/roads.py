"""Simulated rides without noise, whose true figures are known exactly."""

from dataclasses import fields

import numpy as np
from kickstand.units import STANDARD_GRAVITY
from kickstand_tools.analysis.ride import Channels

RATE_HZ = 50.0  # samples per second in which stops are searched
REST_S = 5.0


class Road:
    """A ride that consists of stretches with constant acceleration. The road is level and the bike upright, unless a
    test changes the channels."""

    def __init__(self, *legs: tuple[float, float], rate_hz: float = RATE_HZ):
        """legs: duration in s and acceleration in m/s2 of each stretch. At speed 0 without acceleration the vehicle
        stands."""
        self.t_s = np.arange(0.0, sum(seconds for seconds, _ in legs) - 1e-9, 1.0 / rate_hz)
        ends = np.cumsum([seconds for seconds, _ in legs])
        steps = np.array([mps2 for _, mps2 in legs] + [0.0])
        previous_step, next_step = (steps[np.searchsorted(ends, self.t_s + off)] for off in (-1e-9, 1e-9))
        # where the acceleration jumps, the mean of its values before and after makes the trapezoidal rule exact
        self.mps2 = (previous_step + next_step) / 2.0
        corners = np.concatenate(([0.0], np.cumsum([seconds * mps2 for seconds, mps2 in legs])))
        self.mps = np.interp(self.t_s, np.concatenate(([0.0], ends)), corners)
        self.mps[np.abs(self.mps) < 1e-9] = 0.0
        self.rests = (self.mps == 0.0) & (next_step == 0.0)

    def channels(self, **changed: np.ndarray) -> Channels:
        """Return the channels of the ride, without a speed in the log. changed: channels with other values."""
        n = len(self.t_s)
        columns = {field.name: np.zeros(n) for field in fields(Channels)}
        columns |= {
            "t_s": self.t_s.copy(),
            "up_g": np.ones(n),
            "forward_g": self.mps2 / STANDARD_GRAVITY,
            **dict.fromkeys(("speed_mps", "lat_deg", "lon_deg", "utc_s"), np.full(n, np.nan)),
            "resting": self.rests.astype(float),
            "sure": np.ones(n),
        }
        return Channels(**columns | changed)


def braking(mps: float, mps2: float, before_s: float = 4.0) -> Road:
    """Simulate standing, acceleration at 4 m/s2 to this speed, a straight, and a stop with this deceleration."""
    return Road((REST_S, 0.0), (mps / 4.0, 4.0), (before_s, 0.0), (mps / mps2, -mps2), (REST_S, 0.0))
