"""A track's course: the direction of each step from one point to the next, as far as it is known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..logs.table import Array
from .track import FASTEST_MPS, LONGEST_S, SLOWEST_MPS, Track

STEP_ERROR_M = 1.0  # 1 sigma of a step across its direction: phones' receivers err so from one second to the next
COURSE_ERROR_DEG = 4.0  # 1 sigma of other errors: the gyro's scale factor, and how positions are smoothed


@dataclass
class Course:
    """m steps between the m + 1 points of a track.

    begin_s, end_s (m): times of each step, s since the track's first point. course_deg (m): its direction, > 0 to the
    left of east, if it is good. sigma_deg (m): standard deviation of that. speed_mps (m): its length over its duration.
    good (m): True if it is neither too slow, nor a gap or a jump. turn_deg (m): change of the course against the step
    before, > 0 to the left; 0 unless both are good.
    """

    begin_s: Array
    end_s: Array
    course_deg: Array
    sigma_deg: Array
    speed_mps: Array
    good: NDArray[np.bool_]
    turn_deg: Array


def course(track: Track) -> Course:
    """The Course of a track of at least two points."""
    since_s = track.utc_s - track.utc_s[0]
    east, north = track.steps_m()
    step_s, length_m = np.diff(since_s), np.hypot(east, north)
    speed = length_m / step_s
    good = (speed > SLOWEST_MPS) & (speed < FASTEST_MPS) & (step_s <= LONGEST_S)
    direction = np.degrees(np.arctan2(north, east))
    turn = (np.diff(direction, prepend=direction[:1]) + 180.0) % 360.0 - 180.0
    both = good & np.append(False, good[:-1])
    sigma = np.hypot(np.degrees(STEP_ERROR_M / np.maximum(length_m, 0.1)), COURSE_ERROR_DEG)
    return Course(since_s[:-1], since_s[1:], direction, sigma, speed, good, np.where(both, turn, 0.0))
