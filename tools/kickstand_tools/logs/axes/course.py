"""Which way up an accelerometer reads, told by a track: the gyro's rate about up has to turn as the course does.

An accelerometer alone of the opposite sign gives an exact mirror image of the ride, left and right exchanged, and the
motion of the sensor cannot tell it. Positions can.
"""

import numpy as np
from kickstand.errors import Notice

from ..table import Array

EARTH_M = 6_371_000.0
SLOWEST_MPS = 3.0  # of a course that positions tell
TURNING_DPS = 4.0  # a second that turns faster counts
ENOUGH = 8  # such seconds
CLEAR = 0.6  # correlation of course and gyro, of either sign
LAGS_S = np.arange(0.0, 2.1, 0.25)  # by which positions may be late
CELL_S = 0.25  # from this long to this long the angle turned is kept
MISSING_S = 0.5  # a longer gap between samples: how far the sensor turned meanwhile is unknown


def distance_m(lat: Array, lon: Array, next_lat: Array, next_lon: Array) -> tuple[Array, Array]:
    """How far east and north one position (degrees) is of another, in metres: (n) each, for distances of kilometres."""
    apart_deg = (next_lon - lon + 180.0) % 360.0 - 180.0  # also across the meridian of 180 degrees
    east = np.radians(apart_deg) * np.cos(np.radians(lat)) * EARTH_M
    return east, np.radians(next_lat - lat) * EARTH_M


class Course:
    """add() takes a log's samples block by block; agrees() and notice() judge them."""

    def __init__(self) -> None:
        self._force = np.zeros(3)  # sum of all samples
        self._last = np.full(4, np.nan)  # the last sample: time, and the angle turned since the first one (3, degrees)
        self._turned: list[Array] = []  # the same, some in a second: (k, 4)
        self._places: list[Array] = []  # time, latitude, longitude: (k, 3)

    def add(self, time_s: Array, accel_g: Array, gyro_dps: Array, lat_deg: Array, lon_deg: Array) -> None:
        """time_s (n); accel_g, gyro_dps (n, 3), in the sensor's axes; lat_deg, lon_deg (n): NaN for no new position."""
        there = np.isfinite(lat_deg) & np.isfinite(lon_deg)
        self._places.append(np.column_stack((time_s, lat_deg, lon_deg))[there])
        self._force += np.sum(accel_g, axis=0)
        before_s = time_s[0] if np.isnan(self._last[0]) else self._last[0]
        step_s = np.diff(time_s, prepend=before_s)
        step_s[step_s > MISSING_S] = 0.0
        angle = np.cumsum(gyro_dps * step_s[:, None], axis=0) + np.nan_to_num(self._last[1:])
        cell = np.floor(time_s / CELL_S)
        first = np.flatnonzero(np.diff(cell, prepend=np.floor(self._last[0] / CELL_S)))  # NaN: the first one, too
        self._turned.append(np.column_stack((time_s, angle))[first])
        self._last = np.concatenate((time_s[-1:], angle[-1]))

    def agrees(self) -> bool | None:
        """Does the sensor turn about its up as the positions do? None where too few turns to both sides tell it."""
        places = np.concatenate(self._places) if self._places else np.zeros((0, 3))
        places = places[np.flatnonzero(np.diff(np.floor(places[:, 0]), prepend=-1.0))]  # one a second
        if len(places) < ENOUGH:
            return None
        at_s, lat, lon = places.T
        east, north = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
        step_s = np.diff(at_s)
        moving = (np.hypot(east, north) > SLOWEST_MPS * step_s) & (step_s < 2.5)
        turn_deg = np.degrees(np.diff(np.unwrap(np.arctan2(north, east))))
        middle_s, span_s = at_s[1:-1], (step_s[1:] + step_s[:-1]) / 2.0
        course_dps = turn_deg / span_s
        counted = moving[1:] & moving[:-1] & (np.abs(course_dps) > TURNING_DPS) & (np.abs(course_dps) < 90.0)
        if np.count_nonzero(counted) < ENOUGH:
            return None
        course = course_dps[counted] - np.mean(course_dps[counted])  # what the gyro reads always is no turning
        if np.std(course) < TURNING_DPS:
            return None
        up = self._force / max(float(np.linalg.norm(self._force)), 1e-9)
        samples = np.concatenate([*self._turned, self._last[None]])
        time_s, turned = samples[:, 0], samples[:, 1:] @ up
        best = 0.0
        for lag_s in LAGS_S:
            ends = (np.interp(middle_s - lag_s + half, time_s, turned) for half in (-span_s / 2.0, span_s / 2.0))
            before, after = ends
            about_up = ((after - before) / span_s)[counted]
            about_up -= np.mean(about_up)
            size = float(np.sqrt((course @ course) * (about_up @ about_up)))
            found = float(course @ about_up) / size if size > 0.0 else 0.0
            best = found if abs(found) > abs(best) else best
        return None if abs(best) < CLEAR else best > 0.0

    def notice(self) -> Notice | None:
        """That the log is a mirror image; None if it is none, or if its positions do not tell."""
        return Notice("mirrored") if self.agrees() is False else None


def course_agrees(time_s: Array, accel_g: Array, gyro_dps: Array, lat_deg: Array, lon_deg: Array) -> bool | None:
    """Course.agrees() of a whole log."""
    course = Course()
    course.add(time_s, accel_g, gyro_dps, lat_deg, lon_deg)
    return course.agrees()
