"""Writes CSV v3, the table that RaceChrono exports and related programs read.

The file has metadata, a blank line, and three heading lines: names, units, and sources ("100: gps", "calc", "101: acc",
"102: gyro"). A cell is empty if its source has no new value. Names and units are the same as in RaceChrono's own files:
see https://github.com/ClassicMiniDIY/UltraLog/pull/85 and https://apexlog.io/blog/what-to-do-with-racechrono-data. Also
https://racechrono.com/article/2572 gives acc in G and gyro in deg/s. As in RaceChrono's files, lateral_acc is positive
in a left turn, and longitudinal_acc when speeding up. RaceChrono itself imports sessions as .vbo.
"""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...logs.csv_lines import csv_lines
from ..channels import Channels

_NOTE = "Made by Kickstand. lean_angle > 0 to the right; x left, y up, z forward"
# Each column has name, unit, source, digits, and value. The value is time_s or a channel; "" for an empty cell.
COLUMNS = (
    ("timestamp", "unix time", "", 3, "time_s"),
    ("fragment_id", "", "", 0, "zero"),
    ("lap_number", "", "", 0, ""),
    ("elapsed_time", "s", "", 3, "t_s"),
    ("latitude", "deg", "100: gps", 7, "lat_deg"),
    ("longitude", "deg", "100: gps", 7, "lon_deg"),
    ("speed", "m/s", "100: gps", 3, "speed_mps"),
    ("lateral_acc", "G", "calc", 4, "lateral_g"),
    ("lean_angle", "deg", "calc", 2, "lean_deg"),
    ("longitudinal_acc", "G", "calc", 4, "forward_g"),
    ("x_acc", "G", "101: acc", 4, "left_g"),
    ("y_acc", "G", "101: acc", 4, "up_g"),
    ("z_acc", "G", "101: acc", 4, "forward_g"),
    ("x_rate_of_rotation", "deg/s", "102: gyro", 3, "left_dps"),
    ("y_rate_of_rotation", "deg/s", "102: gyro", 3, "yaw_rate_dps"),
    ("z_rate_of_rotation", "deg/s", "102: gyro", 3, "roll_rate_dps"),
)


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write the file. start_s: Unix time of the first row."""
    head = [
        "This file is created using RaceChrono CSV v3 by Kickstand.",
        "Format,3",
        'Session title,"Ride"',
        "Session type,Lap timing",
        "Track name,",
        "Driver name,",
        time.strftime("Created,%d/%m/%Y,%H:%M", time.gmtime(start_s)),
        f'Note,"{_NOTE}"',
        "",
    ]
    head += [",".join(str(column[k]) for column in COLUMNS) for k in range(3)]
    with open(path, "wb") as file:
        file.write(("\n".join(head) + "\n").encode())
        for block in blocks:
            count = len(block.t_s)
            values = vars(block) | {"zero": np.zeros(count), "": np.full(count, np.nan)}
            values |= {"time_s": block.t_s + start_s, "left_dps": -block.pitch_rate_dps}
            table = np.column_stack([values[column[4]] for column in COLUMNS])
            file.writelines(csv_lines(table, [column[3] for column in COLUMNS]))
