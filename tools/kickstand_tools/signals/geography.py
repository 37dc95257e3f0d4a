"""Distances on the Earth."""

import numpy as np

from . import Array

EARTH_M = 6_371_000.0


def distance_m(lat: Array, lon: Array, next_lat: Array, next_lon: Array) -> tuple[Array, Array]:
    """(n) metres east and (n) metres north from each position to the next one (degrees). For distances of
    kilometres."""
    apart_deg = (next_lon - lon + 180.0) % 360.0 - 180.0  # also across the meridian of 180 degrees
    east = np.radians(apart_deg) * np.cos(np.radians(lat)) * EARTH_M
    return east, np.radians(next_lat - lat) * EARTH_M
