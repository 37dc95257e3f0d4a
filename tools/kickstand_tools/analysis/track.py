"""The track of a ride: the positions in a log, and positions interpolated between them."""

from dataclasses import dataclass

import numpy as np

from ..logs.log import Log
from ..signals import Array
from .channels import Channels

GAP_S = 5.0  # longest time between two positions over which positions are interpolated


@dataclass
class LogTrack:
    """m positions. Each field has the shape (m).

    t_s: seconds since the log's first sample.
    lat_deg: degrees north.
    lon_deg: degrees east.
    """

    t_s: Array
    lat_deg: Array
    lon_deg: Array

    def at(self, t_s: Array) -> tuple[Array, Array]:
        """Interpolate the positions along straight lines, also across 180 degrees.

        Results are NaN before the first position, after the last position, and in gaps of over GAP_S.

        t_s: times, shape (n).
        Returns latitude and longitude, each of shape (n), in degrees.
        """
        none = np.full(len(t_s), np.nan)
        if not len(self.t_s):
            return none, none
        next_index = np.clip(np.searchsorted(self.t_s, t_s), 1, max(1, len(self.t_s) - 1))
        before_s, after_s = self.t_s[next_index - 1], self.t_s[np.minimum(next_index, len(self.t_s) - 1)]
        valid = (t_s >= self.t_s[0]) & (t_s <= self.t_s[-1])
        valid &= (after_s - before_s <= GAP_S) | (t_s == before_s) | (t_s == after_s)
        lat = np.interp(t_s, self.t_s, self.lat_deg)
        lon = np.interp(t_s, self.t_s, np.unwrap(self.lon_deg, period=360.0))  # also across 180 degrees
        return np.where(valid, lat, np.nan), np.where(valid, (lon + 180.0) % 360.0 - 180.0, np.nan)


def track(part: Channels | Log) -> LogTrack:
    """Return the positions in a ride, in a part of it, or in a log."""
    valid = np.isfinite(part.lat_deg) & np.isfinite(part.lon_deg)
    return LogTrack(part.t_s[valid], part.lat_deg[valid], part.lon_deg[valid])
