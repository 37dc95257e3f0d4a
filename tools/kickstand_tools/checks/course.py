"""Checks the sign of a log's accelerations by its track.

The gyro's rate about up and the rate at which the course changes must have the same sign. If only the accelerations
have the opposite sign, the log is an exact mirror image of the ride, with left and right exchanged. The motion of the
sensor cannot show this, but the positions can.
"""

import numpy as np

from ..signals import Array, best_lag, distance_m
from .cells import CellTable, LogCells

SLOWEST_MPS = 3.0  # least speed at which positions show the course
TURNING_DPS = 4.0  # a second counts if the course changes faster than this
FASTEST_DPS = 90.0  # if the course changes faster than this, the positions have jumped
ENOUGH = 8  # fewer usable seconds give no result
# Least correlation of course and gyro, of either sign, and by how many standard errors it must differ from 0. The
# errors of the positions turn the course too: in few seconds with small turns, they correlate with the gyro by chance.
CLEAR, SIGMAS = 0.6, 5.0
LAGS_S = np.arange(0.0, 2.1, 0.25)  # delays of the positions that are tried
LONGEST_S = 2.5  # longest time between two positions


def course_agrees(cells: LogCells) -> bool | None:
    """Compare the signs of the rate about up and of the rate at which the course changes.

    Returns True if the signs are equal, and False if they are opposite. Returns None if the log has too few bends to
    both sides.
    """
    if len(cells.places) < ENOUGH:
        return None
    at_s, lat, lon = cells.places.T
    east, north = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
    step_s = np.diff(at_s)
    moving = (np.hypot(east, north) > SLOWEST_MPS * step_s) & (step_s < LONGEST_S)
    middle_s, span_s = at_s[1:-1], (step_s[1:] + step_s[:-1]) / 2.0
    course_dps = np.degrees(np.diff(np.unwrap(np.arctan2(north, east)))) / span_s
    counted = moving[1:] & moving[:-1] & (np.abs(course_dps) > TURNING_DPS) & (np.abs(course_dps) < FASTEST_DPS)
    course_dps, middle_s, span_s = course_dps[counted], middle_s[counted], span_s[counted]
    if len(course_dps) < ENOUGH or np.std(course_dps) < TURNING_DPS:  # a gyro's bias does not vary with the course
        return None
    up = np.sum(cells.force * cells.even.count[:, None], axis=0)

    def earlier(by_s: float) -> tuple[Array, Array]:
        before, after = (cells.integrals(middle_s - by_s + side * span_s)[:, 3:6] for side in (-0.5, 0.5))
        return course_dps, ((after - before) @ up / span_s)[:, None]

    best = best_lag(LAGS_S, earlier)
    if best is None or best.value < CLEAR:
        return None
    sigmas = best.value * np.sqrt((len(course_dps) - 2) / max(1.0 - best.value**2, 1e-9))
    return bool(best.direction[0] > 0.0) if sigmas > SIGMAS else None


def log_agrees(time_s: Array, accel_g: Array, gyro_dps: Array, lat_deg: Array, lon_deg: Array) -> bool | None:
    """Call course_agrees() for n samples.

    time_s: shape (n).
    accel_g, gyro_dps: shape (n, 3).
    lat_deg, lon_deg: shape (n); NaN for no new position.
    """
    table = CellTable()
    table.add(time_s, accel_g, gyro_dps, np.full(len(time_s), np.nan), lat_deg, lon_deg)
    cells = table.cells()
    return None if cells is None else course_agrees(cells)
