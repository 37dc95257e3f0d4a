"""Racelogic's VBO, which Circuit Tools opens and RaceChrono imports.

Sections, standard channels, and units for the others alone, as in
https://developers.racelogic.co.uk/Portal/Tutorials/tutorialVBOfilestructure.html; columns and their signs as in
https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format and the VBOX HD Lite's user guide:
time HHMMSS.SS, velocity in km/h, latitude and longitude in minutes, long accel > 0 forward, lat accel > 0 to the
left, others with mantissa and exponent. Kickstand has no satellites: their number and the position are 0. Any other
column that the log has no values for is left out, except velocity, which VBO requires: it is then 0, and a comment in
the file says so.
"""

import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np

from ..channels import Channels

# (title in [header], name in [column names]); of the others (both, unit, channel)
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
OTHER = (
    ("lean-angle", "deg", "lean_deg"),
    ("yaw-rate", "deg/s", "yaw_rate_dps"),
    ("roll-rate", "deg/s", "roll_rate_dps"),
    ("temperature", "C", "temp_c"),
)
_STANDARD_ROW = "000 %09.2f +00000.000000 +00000.000000 %07.3f 000.00 +00000.00 %+07.3f %+07.3f"


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Lines end in CR and LF; the date and each row's time are UTC."""
    first = next(blocks)  # a channel that the log does not have is NaN in its first block already
    other = [column for column in OTHER if not np.all(np.isnan(getattr(first, column[2])))]
    lean = "lean-angle in degrees, > 0 to the right; " if OTHER[0] in other else ""
    comments = [f"Kickstand: {lean}no satellites", "Log Rate (Hz) : at most 100.00"]
    if np.all(np.isnan(first.speed_mps)):
        comments.append("no speed in the log: velocity 0 stands for none")
    row_form = _STANDARD_ROW + " %+.6E" * len(other) + "\r\n"
    head = [
        time.strftime("File created on %d/%m/%Y at %H:%M:%S", time.gmtime(start_s)),
        "",
        "[header]",
        *[title for title, _ in STANDARD],
        *[name for name, _, _ in other],
        "",
        "[channel units]",
        *[unit for _, unit, _ in other],
        "",
        "[comments]",
        *comments,
        "",
        "[column names]",
        " ".join([name for _, name in STANDARD] + [name for name, _, _ in other]),
        "",
        "[data]",
    ]
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write("\r\n".join(head) + "\r\n")
        for block in chain([first], blocks):
            table = np.column_stack(
                (
                    _clock(block.t_s + start_s),
                    block.speed_mps * 3.6,
                    block.forward_g,
                    block.lateral_g,
                    *[getattr(block, channel) for _, _, channel in other],
                )
            )
            file.write("".join([row_form % tuple(row) for row in np.nan_to_num(table).tolist()]))


def _clock(seconds: np.ndarray) -> np.ndarray:
    """Since midnight, as the number HHMMSS.SS."""
    hundredths = np.rint(seconds * 100.0).astype(np.int64) % (86400 * 100)
    whole, part = np.divmod(hundredths, 100)
    return (whole // 3600) * 10000 + (whole // 60 % 60) * 100 + whole % 60 + part / 100.0
