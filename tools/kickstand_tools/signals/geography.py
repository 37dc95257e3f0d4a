"""Distances on the Earth."""

import numpy as np

from . import Array

EARTH_M = 6_371_000.0


def distance_m(lat: Array, lon: Array, next_lat: Array, next_lon: Array) -> tuple[Array, Array]:
    """How far east and north one position (degrees) is of another, in metres: (n) each, for distances of kilometres."""
    apart_deg = (next_lon - lon + 180.0) % 360.0 - 180.0  # also across the meridian of 180 degrees
    east = np.radians(apart_deg) * np.cos(np.radians(lat)) * EARTH_M
    return east, np.radians(next_lat - lat) * EARTH_M
