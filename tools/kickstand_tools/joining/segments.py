"""A track's course and speed in segments of half a minute, which are compared with a ride's one by one.

Within a segment only changes count: its mean and its trend are subtracted. This removes the gyro's residual bias, the
direction in which the ride began, and hills.
"""

from dataclasses import dataclass

import numpy as np

from ..logs.log import Table
from ..signals import Array, stretches
from .track import Course

STEPS = 30  # most steps of a segment
_FEWEST = 8  # least number of steps of a segment


@dataclass
class Segments(Table):
    """p segments of up to STEPS good steps in a row, all (p, STEPS); weights are 0 where a segment is shorter.

    begin_s, end_s: times of each step, s since the track's first point. turned_deg: course of each step less that of
    the segment's first one, > 0 to the left. course_weight: 1/deg2. speed_mps; speed_weight: 1 or 0. Mean and trend of
    turned_deg and speed_mps are subtracted.
    """

    begin_s: Array
    end_s: Array
    turned_deg: Array
    course_weight: Array
    speed_mps: Array
    speed_weight: Array

    @property
    def middle_s(self) -> Array:
        """(p, STEPS) time of the middle of each step."""
        return (self.begin_s + self.end_s) / 2.0


def segments(course: Course) -> Segments:
    """The segments of a course."""
    rows = [
        np.arange(start, min(start + STEPS, end))
        for begin, end in stretches(course.good)
        for start in range(begin, end, STEPS)
    ]
    rows = [row for row in rows if len(row) >= _FEWEST]
    place, there = np.zeros((len(rows), STEPS), dtype=int), np.zeros((len(rows), STEPS))
    for k, row in enumerate(rows):
        place[k, : len(row)], place[k, len(row) :], there[k, : len(row)] = row, row[-1], 1.0
    turn = course.turn_deg[place] * there
    turn[:, :1] = 0.0
    weight = there / course.sigma_deg[place] ** 2
    begin_s, end_s = course.begin_s[place], course.end_s[place]
    made = Segments(begin_s, end_s, np.cumsum(turn, axis=1), weight, course.speed_mps[place], there)
    made.turned_deg = without_trend(made.turned_deg, weight, made.middle_s)
    made.speed_mps = without_trend(made.speed_mps, there, made.middle_s)
    return made


def without_trend(values: Array, weight: Array, at_s: Array) -> Array:
    """(p, STEPS) values less the straight line that fits each row best."""
    total = np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    since = at_s - (weight * at_s).sum(axis=1, keepdims=True) / total
    mean = (weight * values).sum(axis=1, keepdims=True) / total
    spread = np.maximum((weight * since * since).sum(axis=1, keepdims=True), 1e-12)
    return values - mean - (weight * since * values).sum(axis=1, keepdims=True) / spread * since
