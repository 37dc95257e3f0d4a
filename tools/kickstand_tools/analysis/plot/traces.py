"""What the picture and the page of a ride both draw."""

from dataclasses import dataclass

import numpy as np

from ...logs.table import Array
from ...signals.averages import moving_mean
from ..downsample import spacing_s
from ..overview import Overview
from ..report import angles, clock, judged, peak_words
from ..summary import BINS_DEG, Peak

LEFT_COLOUR, RIGHT_COLOUR = "#2563a8", "#c2571a"
BRAKE_COLOUR, LATERAL_COLOUR = "#9b2335", "#3d7f6b"
SPEED_COLOUR = "#5b4b8a"
SMOOTH_S = 0.3
GG_BIN_G = 0.025


@dataclass
class Traces:
    """What is drawn over time. lean_deg is NaN where the display shows none; lateral_g, forward_g are smoothed.

    gg_s: seconds in each cell of a grid with the edges gg_edges_g: rows forward_g, columns lateral_g.
    """

    time_s: Array
    lean_deg: Array
    speed_kmh: Array
    lateral_g: Array
    forward_g: Array
    gg_s: Array
    gg_edges_g: Array


def traces(seen: Overview) -> Traces:
    """The traces of a ride."""
    course = seen.course
    step_s = spacing_s(course)
    n = round(SMOOTH_S / step_s)
    lateral, forward = moving_mean(course.lateral_g, n), moving_mean(course.forward_g, n)
    moving = course.resting < 0.5
    reach = max(0.5, float(np.percentile(np.abs(np.concatenate((lateral, forward))), 99.99)))
    edges = np.arange(-np.ceil(reach / GG_BIN_G) - 2, np.ceil(reach / GG_BIN_G) + 3) * GG_BIN_G
    gg = np.histogram2d(forward[moving], lateral[moving], bins=(edges, edges))[0] * step_s
    lean = np.where(course.trusted, course.lean_deg, np.nan)
    return Traces(course.t_s, lean, course.speed_mps * 3.6, lateral, forward, gg, edges)


def title(seen: Overview) -> str:
    """One line: name and length of the ride, and its maxima."""
    total = seen.summary
    said = [seen.ride.stem, clock(total.duration_s)]
    if not seen.ride.car:
        how = "smoothed lean" if seen.ride.smoothed else "lean as displayed"
        left, right = peak_words(total.left_deg, "{:.0f}°")[0], peak_words(total.right_deg, "{:.0f}°")[0]
        said.append(f"{how} {left} left, {right} right")
    brake, accel = peak_words(total.brake_g, "{:.2f} g")[0], peak_words(total.accel_g, "{:.2f} g")[0]
    said.append(f"braking {brake}, acceleration {accel}")
    return "  ·  ".join(said)


def maxima(seen: Overview) -> list[tuple[Peak, float]]:
    """The largest lean to each side, and its sign in the picture."""
    peaks = ((seen.summary.left_deg, -1.0), (seen.summary.right_deg, 1.0))
    return [(peak, sign) for peak, sign in peaks if peak.time_s is not None]


def lean_limit(seen: Overview) -> float:
    """Degrees to each side that the lean's axis shows."""
    return max(20.0, 1.2 * max(seen.summary.left_deg.value, seen.summary.right_deg.value))


def histogram(seen: Overview) -> tuple[Array, Array]:
    """Middles of the bins in degrees, and the share of the riding time in each in per cent."""
    seconds = seen.summary.histogram_s
    return (BINS_DEG[:-1] + BINS_DEG[1:]) / 2.0, 100.0 * seconds / max(float(np.sum(seconds)), 1e-9)


def quality_lines(seen: Overview) -> list[str]:
    """One line for each thing that the ride says about the alignment."""
    quality = seen.quality
    if not judged(seen):
        return ["not judged"]
    lines = angles(quality) or ["not enough straight riding"]
    return lines if quality.gravity_g is None else [*lines, f"at rest {quality.gravity_g:.3f} g"]


def tick_s(seconds: float) -> float:
    """A round time between ticks, so that there are 6 to 12 of them."""
    return next((tick for tick in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800) if seconds < 12 * tick), 3600)
