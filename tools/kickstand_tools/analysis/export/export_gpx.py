"""Writes GPX 1.1 for maps, route planners and programs that put data on videos: https://www.topografix.com/GPX/1/1/

Each position of the log becomes a track point. GPX 1.1 has no element for the speed, so the speed is written in
Garmin's TrackPointExtension, https://www8.garmin.com/xmlschemas/TrackPointExtensionv2.xsd. A lean that the meter
trusts, > 0 to the right, is written in Kickstand's own element.
"""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ..channels import Channels
from ..track import GAP_S

if TYPE_CHECKING:
    from gpxpy.gpx import GPXTrackPoint

GARMIN = "http://www.garmin.com/xmlschemas/TrackPointExtension/v2"
KICKSTAND = "urn:kickstand"


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write the file. After a gap, a new segment begins.

    start_s: Universal Time of the log's first sample, for positions without a time.
    """
    from gpxpy.gpx import GPX, GPXTrack, GPXTrackSegment

    gpx, track = GPX(), GPXTrack(name="Ride")
    gpx.creator = "Kickstand"
    gpx.nsmap |= {"gpxtpx": GARMIN, "kickstand": KICKSTAND}
    gpx.tracks.append(track)
    last_s = -np.inf
    for block in blocks:
        lean_deg = np.where(block.trusted, block.lean_deg, np.nan)
        utc_s = np.where(np.isfinite(block.utc_s), block.utc_s, start_s + block.t_s)
        columns = (block.t_s, block.lat_deg, block.lon_deg, utc_s, block.speed_mps, lean_deg)
        for t, *values in np.column_stack(columns).tolist():
            if t - last_s > GAP_S:
                track.segments.append(GPXTrackSegment())
            track.segments[-1].points.append(_point(*values))
            last_s = t
    path.write_text(gpx.to_xml(version="1.1"), encoding="utf-8")


def _point(lat_deg: float, lon_deg: float, utc_s: float, speed_mps: float, lean_deg: float) -> "GPXTrackPoint":
    from gpxpy.gpx import GPXTrackPoint

    point = GPXTrackPoint(lat_deg, lon_deg, time=datetime.fromtimestamp(round(utc_s, 3), UTC))
    if speed_mps == speed_mps:  # not NaN
        garmin = Element(f"{{{GARMIN}}}TrackPointExtension")
        SubElement(garmin, f"{{{GARMIN}}}speed").text = f"{speed_mps:.2f}"
        point.extensions.append(garmin)
    if lean_deg == lean_deg:
        lean = Element(f"{{{KICKSTAND}}}lean_deg")
        lean.text = f"{lean_deg:.1f}"
        point.extensions.append(lean)
    return point
