"""Which way up an accelerometer reads, told by a track: the gyro's rate about up has to turn as the course does.

An accelerometer alone of the opposite sign gives an exact mirror image of the ride, left and right exchanged, and the
motion of the sensor cannot tell it. Positions can.
"""

import numpy as np

from ..table import Array

EARTH_M = 6_371_000.0
SLOWEST_MPS = 3.0  # of a course that positions tell
TURNING_DPS = 4.0  # a second that turns faster counts
ENOUGH = 8  # such seconds
CLEAR = 0.6  # correlation of course and gyro, of either sign
LAGS_S = np.arange(0.0, 2.1, 0.25)  # by which positions may be late


def distance_m(lat: Array, lon: Array, next_lat: Array, next_lon: Array) -> tuple[Array, Array]:
    """How far east and north one position (degrees) is of another, in metres: (n) each, for distances of kilometres."""
    apart_deg = (next_lon - lon + 180.0) % 360.0 - 180.0  # also across the meridian of 180 degrees
    east = np.radians(apart_deg) * np.cos(np.radians(lat)) * EARTH_M
    return east, np.radians(next_lat - lat) * EARTH_M


def course_agrees(time_s: Array, accel_g: Array, gyro_dps: Array, lat_deg: Array, lon_deg: Array) -> bool | None:
    """Does the sensor turn about its up as the positions do? None where there are too few turns to tell.

    time_s (n), accel_g, gyro_dps (n, 3); lat_deg, lon_deg (n): NaN where there is no new position.
    """
    there = np.flatnonzero(np.isfinite(lat_deg) & np.isfinite(lon_deg))
    if len(there) < ENOUGH:
        return None
    since_s = time_s - time_s[0]
    there = there[np.append(True, np.diff(np.floor(since_s[there])) > 0)]  # one a second
    if len(there) < ENOUGH:
        return None
    at_s, lat, lon = since_s[there], lat_deg[there], lon_deg[there]
    east, north = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
    step_s = np.diff(at_s)
    moving = (np.hypot(east, north) > SLOWEST_MPS * step_s) & (step_s < 2.5)
    turn_deg = np.degrees(np.diff(np.unwrap(np.arctan2(north, east))))
    good = moving[1:] & moving[:-1]
    middle_s, span_s = at_s[1:-1], (step_s[1:] + step_s[:-1]) / 2.0
    course_dps = turn_deg / span_s
    up = accel_g.mean(axis=0) / max(float(np.linalg.norm(accel_g.mean(axis=0))), 1e-9)
    turned = np.concatenate(([0.0], np.cumsum((gyro_dps[:-1] @ up) * np.diff(since_s))))
    best = 0.0
    for lag_s in LAGS_S:
        before, after = (np.interp(middle_s - lag_s + half, since_s, turned) for half in (-span_s / 2.0, span_s / 2.0))
        about_up = (after - before) / span_s
        counted = good & (np.abs(course_dps) > TURNING_DPS) & (np.abs(course_dps) < 90.0)
        if np.count_nonzero(counted) < ENOUGH:
            return None
        a, b = course_dps[counted], about_up[counted]
        size = float(np.sqrt((a @ a) * (b @ b)))
        found = float(a @ b) / size if size > 0.0 else 0.0
        best = found if abs(found) > abs(best) else best
    return None if abs(best) < CLEAR else best > 0.0
