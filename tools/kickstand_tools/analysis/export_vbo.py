"""Racelogic's VBO, which Circuit Tools opens and RaceChrono imports.

Sections, standard channels, and units for the others alone, as in
https://developers.racelogic.co.uk/Portal/Tutorials/tutorialVBOfilestructure.html; columns and their signs as in
https://en.racelogic.support/VBOX_Automotive/Knowledge_Base/VBO_File_Format and the VBOX HD Lite's user guide:
time HHMMSS.SS, velocity in km/h, latitude and longitude in minutes, long accel > 0 forward, lat accel > 0 to the
left, others with mantissa and exponent. Kickstand has no satellites: their number and the position are 0.
"""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .channels import Channels

# (title in [header], name in [column names]); the standard ones first, and the units of the others
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
OTHER = (("lean-angle", "deg"), ("yaw-rate", "deg/s"), ("roll-rate", "deg/s"), ("temperature", "C"))
_ROW = "000 %09.2f +00000.000000 +00000.000000 %07.3f 000.00 +00000.00 %+07.3f %+07.3f" + " %+.6E" * len(OTHER) + "\r\n"


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Lines end in CR and LF; the date and each row's time are UTC. Without a speed in the log velocity is 0."""
    titles = [title for title, _ in STANDARD] + [name for name, _ in OTHER]
    head = [
        time.strftime("File created on %d/%m/%Y at %H:%M:%S", time.gmtime(start_s)),
        "",
        "[header]",
        *titles,
        "",
        "[channel units]",
        *[unit for _, unit in OTHER],
        "",
        "[comments]",
        "Kickstand: lean-angle in degrees, > 0 to the right; no satellites",
        "Log Rate (Hz) : at most 100.00",
        "",
        "[column names]",
        " ".join([name for _, name in STANDARD] + [name for name, _ in OTHER]),
        "",
        "[data]",
    ]
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write("\r\n".join(head) + "\r\n")
        for block in blocks:
            table = np.column_stack(
                (
                    _clock(block.t_s + start_s),
                    block.speed_mps * 3.6,
                    block.forward_g,
                    block.lateral_g,
                    block.lean_deg,
                    block.yaw_rate_dps,
                    block.roll_rate_dps,
                    block.temp_c,
                )
            )
            file.write("".join([_ROW % tuple(row) for row in np.nan_to_num(table).tolist()]))


def _clock(seconds: np.ndarray) -> np.ndarray:
    """Since midnight, as the number HHMMSS.SS."""
    hundredths = np.rint(seconds * 100.0).astype(np.int64) % (86400 * 100)
    whole, part = np.divmod(hundredths, 100)
    return (whole // 3600) * 10000 + (whole // 60 % 60) * 100 + whole % 60 + part / 100.0
