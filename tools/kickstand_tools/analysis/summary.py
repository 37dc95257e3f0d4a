"""What a ride comes to: maxima with their times, time at large leans, the histogram. Block by block."""

from dataclasses import dataclass, field

import numpy as np
from kickstand.lean.meter import GAP_US

from .channels import Array, Channels

LEANS_DEG = (30.0, 40.0)
BIN_DEG = 1.0
BINS_DEG = np.arange(-70.0, 70.0 + BIN_DEG, BIN_DEG)


@dataclass
class Peak:
    """The largest value so far and when it was, in s from the start; 0 and None if there was none."""

    value: float = 0.0
    time_s: float | None = None

    def add(self, t_s: Array, values: Array) -> None:
        """values: NaN where they do not count."""
        if len(values) and np.nanmax(values, initial=-np.inf) > self.value:
            at = int(np.nanargmax(values))
            self.value, self.time_s = float(values[at]), float(t_s[at])


@dataclass
class Summary:
    """add() every block. Leans count where the display would show them; g is smoothed as on the display."""

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

    def add(self, block: Channels) -> None:
        """The next part of the ride."""
        t = block.t_s
        step = np.diff(t, prepend=self.duration_s if self.samples else t[0])
        step = np.where(step * 1e6 > GAP_US, 0.0, step)  # readings were missing
        self.samples += len(t)
        self.duration_s = float(t[-1])
        sure = block.trusted
        lean = np.where(sure, block.lean_deg, np.nan)
        forward = np.where(sure, block.shown_g, np.nan)
        self.right_deg.add(t, lean)
        self.left_deg.add(t, -lean)
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
