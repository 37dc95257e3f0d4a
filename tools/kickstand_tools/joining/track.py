"""The track of a phone or a watch: where it was, and when."""

from dataclasses import dataclass

import numpy as np

from ..logs.table import Array, Table

EARTH_M = 6_371_000.0
LONGEST_S = 6.0  # between two points of one course: watches write one so rarely on straights
FASTEST_MPS = 100.0  # a quicker step is a jump of the receiver


@dataclass(eq=False)
class Track(Table):
    """n points in the order of time.

    utc_s: s since 1970, increasing. lat_deg, lon_deg: north and east. speed_mps: as the file has it, NaN where it has
    none. name: the file's.
    """

    utc_s: Array
    lat_deg: Array
    lon_deg: Array
    speed_mps: Array
    name: str

    def speeds_mps(self) -> Array:
        """(n) those of the file, or where it has none by how far the points before and after are from here."""
        if np.any(np.isfinite(self.speed_mps)) or len(self.utc_s) < 3:
            return self.speed_mps
        length_m, step_s = np.hypot(*self.steps_m()), np.diff(self.utc_s)
        speed = np.full(len(self.utc_s), np.nan)
        speed[1:-1] = (length_m[1:] + length_m[:-1]) / (step_s[1:] + step_s[:-1])
        gap = step_s > LONGEST_S
        speed[1:-1][gap[1:] | gap[:-1]] = np.nan
        return speed

    def steps_m(self) -> tuple[Array, Array]:
        """(n - 1) each: how far east and north every point is of the one before."""
        east = np.radians((np.diff(self.lon_deg) + 180.0) % 360.0 - 180.0) * np.cos(np.radians(self.lat_deg[1:]))
        return EARTH_M * east, EARTH_M * np.radians(np.diff(self.lat_deg))
