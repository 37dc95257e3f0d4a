"""Writes Racelogic's VBO, which Circuit Tools opens and RaceChrono imports.

Sections and standard channels follow
https://developers.racelogic.co.uk/Portal/Tutorials/tutorialVBOfilestructure.html. Standard channels have no units. All
other channels have units. Columns and signs follow
https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format and the user guide of the VBOX HD Lite:

* time: HHMMSS.SS
* velocity: km/h
* latitude and longitude: minutes, north and west positive
* heading: degrees clockwise from north
* long accel: positive forward
* lat accel: positive to the left
* other channels: with mantissa and exponent

A log does not contain the number of satellites. The file says 4, because a position needs at least 4. Without a
position, satellites and position are written as 0. Other columns without values are left out. VBO requires a velocity.
If the log has no speed, the velocity is 0, and a comment in the file says so.
"""

import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np

from ...signals import Array, distance_m
from ..channels import Channels

# A standard channel has a title in [header], and a name in [column names].
STANDARD = (
    ("satellites", "sats"),
    ("time", "time"),
    ("latitude", "lat"),
    ("longitude", "long"),
    ("velocity kmh", "velocity"),
    ("heading", "heading"),
    ("height", "height"),
    ("long accel g", "longacc"),
    ("lat accel g", "latacc"),
)
# Each other channel has a title, a unit, and the name of the channel of a ride.
OTHER = (
    ("lean-angle", "deg", "lean_deg"),
    ("yaw-rate", "deg/s", "yaw_rate_dps"),
    ("roll-rate", "deg/s", "roll_rate_dps"),
    ("temperature", "C", "temp_c"),
)
_STANDARD_ROW = "%03d %09.2f %+013.6f %+013.6f %07.3f %06.2f +00000.00 %+07.3f %+07.3f"
_SATELLITES = 4
_SAME_M = 1e-3  # a larger movement between two rows, which are 0.01 s apart, gives a new heading


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write the file. Lines end in CR and LF. Date and times are UTC.

    blocks: at least one block. They should have positions in as many rows as possible. A channel that is NaN in the
        whole first block is left out of the file.
    start_s: time of the log's t_s = 0, in s since 1970.
    """
    first = next(blocks)  # the first block shows which channels the log has; a missing channel is NaN in all blocks
    extra_columns = [column for column in OTHER if not np.all(np.isnan(getattr(first, column[2])))]
    lean = "lean-angle in degrees, > 0 to the right; " if OTHER[0] in extra_columns else ""
    satellites = f"satellites {_SATELLITES} stands for a position, 0 for none"
    comments = [f"Kickstand: {lean}{satellites}", "Log Rate (Hz) : at most 100.00"]
    if np.all(np.isnan(first.speed_mps)):
        comments.append("no speed in the log: velocity 0 stands for none")
    row_form = _STANDARD_ROW + " %+.6E" * len(extra_columns) + "\r\n"
    head = [
        time.strftime("File created on %d/%m/%Y at %H:%M:%S", time.gmtime(start_s)),
        "",
        "[header]",
        *[title for title, _ in STANDARD],
        *[name for name, _, _ in extra_columns],
        "",
        "[channel units]",
        *[unit for _, unit, _ in extra_columns],
        "",
        "[comments]",
        *comments,
        "",
        "[column names]",
        " ".join([name for _, name in STANDARD] + [name for name, _, _ in extra_columns]),
        "",
        "[data]",
    ]
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write("\r\n".join(head) + "\r\n")
        course_deg = _Heading()
        for block in chain([first], blocks):
            placed = np.isfinite(block.lat_deg)
            table = np.column_stack(
                (
                    placed * _SATELLITES,
                    _clock(block.t_s + start_s),
                    60.0 * block.lat_deg,
                    -60.0 * block.lon_deg,
                    block.speed_mps * 3.6,
                    course_deg.of(block.lat_deg, block.lon_deg),
                    block.forward_g,
                    block.lateral_g,
                    *[getattr(block, channel) for _, _, channel in extra_columns],
                )
            )
            file.write("".join([row_form % tuple(row) for row in np.nan_to_num(table).tolist()]))


class _Heading:
    """Computes headings from positions, block by block."""

    def __init__(self) -> None:
        self._last = np.full((3, 1), np.nan)  # latitude, longitude and heading of the last row of the previous block

    def of(self, lat_deg: Array, lon_deg: Array) -> Array:
        """Return the heading from the previous row to each row, shape (n), in degrees clockwise from north.

        If two rows have the same position, the heading of the previous row is kept. The first row with a position has
        the heading of the second row.
        """
        lat, lon = (np.concatenate((last, now)) for last, now in zip(self._last, (lat_deg, lon_deg)))
        east, north = distance_m(lat[:-1], lon[:-1], lat[1:], lon[1:])
        heading = np.concatenate((self._last[2], np.degrees(np.arctan2(east, north)) % 360.0))
        # A distance of NaN counts as a movement, because a gap ends the track.
        moved = np.concatenate(([True], ~(np.hypot(east, north) <= _SAME_M)))
        heading = heading[np.maximum.accumulate(np.where(moved, np.arange(len(heading)), 0))]
        first = np.flatnonzero(np.isnan(heading[:-1]) & np.isfinite(lat[:-1]))
        heading[first] = heading[first + 1]
        self._last = np.array([[lat[-1]], [lon[-1]], [heading[-1]]])
        return heading[1:]


def _clock(seconds: np.ndarray) -> np.ndarray:
    """Convert seconds to the time of day, as the number HHMMSS.SS."""
    hundredths = np.rint(seconds * 100.0).astype(np.int64) % (86400 * 100)
    full_s, part = np.divmod(hundredths, 100)
    return (full_s // 3600) * 10000 + (full_s // 60 % 60) * 100 + full_s % 60 + part / 100.0
