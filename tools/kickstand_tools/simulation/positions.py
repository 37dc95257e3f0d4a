"""Where a simulated ride goes on a map, and when: its true speed and yaw rate, integrated."""

import numpy as np
from numpy.typing import NDArray

from .ride import Ride

START = 47.6, 8.0  # degrees north and east, heading east
START_UTC_S = 1_779_008_400.0  # 09:00 on 17 May 2026
_DEGREE_M = np.radians(6_371_000.0)


def positions(made: Ride) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Latitude, longitude (degrees north and east) and Universal Time (s since 1970) of each reading."""
    course = np.cumsum(np.radians(made.truth["yaw_rate_dps"])) / made.rate_hz  # to the left of east
    speed = made.truth["speed_mps"] / made.rate_hz
    lat = START[0] + np.cumsum(speed * np.sin(course)) / _DEGREE_M
    lon = START[1] + np.cumsum(speed * np.cos(course)) / (_DEGREE_M * np.cos(np.radians(START[0])))
    return lat, lon, START_UTC_S + made.time
