"""Summarises a ride block by block: maxima with their times, time at large leans, and a histogram of the lean."""

from dataclasses import dataclass, field

import numpy as np
from kickstand.lean.meter import HELD_US
from kickstand.units import GAP_US, LOST_US

from ..signals import Array
from .channels import Channels

LEANS_DEG = (30.0, 40.0)
BIN_DEG = 1.0
HELD_S = 2e-6 * HELD_US  # a maximum of the lean must last this long, as on the display
BINS_DEG = np.arange(-70.0, 70.0 + BIN_DEG, BIN_DEG)


@dataclass
class Peak:
    """The largest value so far, and its time in the log.

    value: 0 without a value.
    time_s: None without a value.
    """

    value: float = 0.0
    time_s: float | None = None

    def add(self, t_s: Array, values: Array) -> None:
        """Add values and their times, both of shape (n). A value that does not count is NaN."""
        if len(values) and np.nanmax(values, initial=-np.inf) > self.value:
            index = int(np.nanargmax(values))
            self.value, self.time_s = float(values[index]), float(t_s[index])


@dataclass
class Summary:
    """A ride in numbers. Call add() block by block.

    The maxima of lean and force count only while the display would show the lean.

    samples: number of samples.
    duration_s: time from the first to the last sample.
    left_deg, right_deg: largest lean to each side that lasted for HELD_S.
    brake_g, accel_g: largest forces, smoothed as on the display.
    speed_mps: largest speed.
    riding_s: time in which the lean filter finds no rest. Unlike Overview.riding_s, it includes stops with a shaking
        engine.
    beyond_s: time at or above each lean. The key is the lean in degrees.
    histogram_s: time at the leans of each bin of BINS_DEG, while riding with a trusted lean.
    not_sure_s: time in which the display would not show the lean.
    missing_s: total length of the gaps in the readings. A gap is longer than LOST_US and 4 usual steps.
    frozen_s: the part of missing_s with frozen readings.
    """

    samples: int = 0
    duration_s: float = 0.0
    left_deg: Peak = field(default_factory=Peak)
    right_deg: Peak = field(default_factory=Peak)
    brake_g: Peak = field(default_factory=Peak)
    accel_g: Peak = field(default_factory=Peak)
    speed_mps: Peak = field(default_factory=Peak)
    riding_s: float = 0.0
    beyond_s: dict[float, float] = field(default_factory=lambda: dict.fromkeys(LEANS_DEG, 0.0))
    histogram_s: Array = field(default_factory=lambda: np.zeros(len(BINS_DEG) - 1))
    not_sure_s: float = 0.0
    missing_s: float = 0.0
    frozen_s: float = 0.0
    _begin_s: float = 0.0
    _last_t_s: Array = field(default_factory=lambda: np.zeros(0))  # the last samples of the previous block
    _last_deg: Array = field(default_factory=lambda: np.zeros(0))

    def add(self, block: Channels) -> None:
        """Add the next part of the ride."""
        t = block.t_s
        self._begin_s = t[0] if not self.samples else self._begin_s
        step = np.diff(t, prepend=self._begin_s + self.duration_s)
        longest_s = max(LOST_US / 1e6, 4.0 * float(np.median(step)))  # at a low sample rate, long steps are no gaps
        self.missing_s += float(np.sum(step[step > longest_s]))
        step = np.where(step * 1e6 > GAP_US, 0.0, step)  # readings were missing
        self.samples += len(t)
        self.duration_s = float(t[-1] - self._begin_s)
        sure = block.trusted
        lean = np.where(sure, block.lean_deg, np.nan)
        forward = np.where(sure, block.shown_g, np.nan)
        self._update_maxima(t, lean)
        self.accel_g.add(t, forward)
        self.brake_g.add(t, -forward)
        self.speed_mps.add(t, block.speed_mps)
        for limit in self.beyond_s:
            self.beyond_s[limit] += float(np.sum(step[np.abs(lean) >= limit]))
        riding = block.resting < 0.5
        self.riding_s += float(np.sum(step[riding]))
        self.not_sure_s += float(np.sum(step[~sure]))
        held = riding & sure
        self.histogram_s += np.histogram(block.lean_deg[held], BINS_DEG, weights=step[held])[0]

    def _update_maxima(self, t_s: Array, lean: Array) -> None:
        """Update the maxima of the lean that last for HELD_S. lean: NaN where it is not trusted."""
        if not len(t_s):
            return
        step_s = float(np.median(np.diff(t_s))) if len(t_s) > 1 else HELD_S
        n = max(1, round(HELD_S / max(step_s, 1e-6)))
        t_s, lean = np.append(self._last_t_s, t_s), np.append(self._last_deg, lean)
        self._last_t_s, self._last_deg = t_s[-n:], lean[-n:]
        if len(lean) > n:
            for peak, values in ((self.right_deg, lean), (self.left_deg, -lean)):
                windows = np.lib.stride_tricks.sliding_window_view(values, n + 1)  # each window has n steps
                least = np.min(windows, axis=1)
                best = int(np.argmax(np.where(np.isnan(least), -np.inf, least)))
                index = best + int(np.argmin(windows[best]))
                peak.add(t_s[index : index + 1], least[best : best + 1])


def summary(channels: Channels) -> Summary:
    """Summarise a ride in numbers, from its channels (see vehicle_channels).

    >>> import numpy as np
    >>> from kickstand_tools.api import CalibrationFile, Log, vehicle_channels
    >>> log = Log(np.arange(251) / 100.0, np.tile([0.0, 1.0, 0.0], (251, 1)), np.zeros((251, 3)))
    >>> total = summary(vehicle_channels(log, CalibrationFile(aligned=True)))
    >>> total.samples, total.duration_s, total.speed_mps.time_s
    (251, 2.5, None)
    """
    total = Summary()
    total.add(channels)
    return total
