"""Draws the lean of every estimator over time.

The picture shows the whole first ride, and from each ride the minute with the most leaning.
"""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
from kickstand_tools.common.errors import InputError, extra
from kickstand_tools.signals import window_spreads
from numpy.typing import NDArray

ZOOM_S = 60.0
# Colour and line width of each lean. The leans are drawn in this order, noisy leans first
_STYLES = {
    "formula": ("0.8", 0.4),
    "formula 0.3 s": ("tab:olive", 0.7),
    "complementary": ("tab:blue", 0.9),
    "mahony": ("tab:purple", 0.9),
    "madgwick": ("tab:green", 0.9),
    "vqf": ("tab:orange", 0.9),
    "fusion": ("tab:brown", 0.9),
    "mahony best": ("tab:purple", 0.5),
    "madgwick best": ("tab:green", 0.5),
    "vqf best": ("tab:orange", 0.5),
    "fusion best": ("tab:brown", 0.5),
    "GPS 1 Hz": ("0.6", 0.9),
    "GPS 10 Hz": ("0.4", 0.6),
    "possible": ("tab:pink", 1.2),
    "true": ("black", 1.8),
    "reference": ("black", 1.8),
    "kickstand": ("tab:red", 1.4),
    "smoothed": ("tab:cyan", 1.2),
}


def check() -> None:
    """Raise InputError if matplotlib is not installed."""
    if not find_spec("matplotlib"):
        raise InputError("the picture needs matplotlib: " + extra("evaluate"))


def draw(path: Path, rides: dict[str, dict[str, NDArray[np.float64]]]) -> None:
    """Write a PNG. Needs matplotlib.

    rides: traces of runs.Result or of real_ride.RecordingScores, by the title of the ride.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 3.7 * (len(rides) + 1)), layout="constrained")
    axes = figure.subplots(len(rides) + 1, 1, squeeze=False)[:, 0]
    _lines(axes[0], next(iter(rides)), next(iter(rides.values())), whole=True)
    for axis, (title, leans) in zip(axes[1:], rides.items()):
        _lines(axis, f"{title}, the {ZOOM_S:.0f} s with the most leaning", leans, whole=False)
    for line in axes[0].legend(ncols=9, loc="upper center", fontsize="small").get_lines():
        line.set_linewidth(2.0)
    axes[-1].set_xlabel("s")
    figure.savefig(path, dpi=100)


def zoom_start(time: NDArray, true: NDArray) -> float:
    """Find the ZOOM_S seconds in which the true lean has the largest variance. Returns their start, in s."""
    n = max(int(np.searchsorted(time, time[0] + ZOOM_S)), 1)
    if n >= len(time):
        return float(time[0])
    return float(time[int(np.argmax(window_spreads(true, n)))])


def _lines(axis, title: str, leans: dict[str, NDArray], whole: bool) -> None:
    time, true = leans["time"], leans["true" if "true" in leans else "reference"]
    start = zoom_start(time, true)
    part = (time >= start) & (time < start + ZOOM_S) | whole
    for name, (colour, width) in _STYLES.items():
        if name in leans:
            axis.plot(time[part], leans[name][part], color=colour, linewidth=width, label=name)
    limit = 1.25 * float(np.max(np.abs(true))) + 5.0
    axis.set(title=title, ylabel="lean, deg (> 0 right)", ylim=(-limit, limit))
    axis.margins(x=0.0)
    axis.grid(alpha=0.3)
