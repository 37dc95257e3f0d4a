"""CSV v3, the table that RaceChrono exports and the programs around it read.

Metadata, a blank line, then three lines of heads: names, units, sources ("100: gps", "calc", "101: acc", "102:
gyro"); a cell is empty where its source has no new value. Names and units as in RaceChrono's own files: see
https://github.com/ClassicMiniDIY/UltraLog/pull/85 and https://apexlog.io/blog/what-to-do-with-racechrono-data;
acc in G and gyro in deg/s also in https://racechrono.com/article/2572. In those files lateral_acc is positive in
a left turn and longitudinal_acc when speeding up, as here. RaceChrono itself imports sessions as .vbo.
"""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...logs.csv_lines import csv_lines
from ..channels import Channels

_NOTE = "Made by Kickstand. lean_angle > 0 to the right; x left, y up, z forward"
# name, unit, source, digits
COLUMNS = (
    ("timestamp", "unix time", "", 3),
    ("fragment_id", "", "", 0),
    ("lap_number", "", "", 0),
    ("elapsed_time", "s", "", 3),
    ("latitude", "deg", "100: gps", 7),
    ("longitude", "deg", "100: gps", 7),
    ("speed", "m/s", "100: gps", 3),
    ("lateral_acc", "G", "calc", 4),
    ("lean_angle", "deg", "calc", 2),
    ("longitudinal_acc", "G", "calc", 4),
    ("x_acc", "G", "101: acc", 4),
    ("y_acc", "G", "101: acc", 4),
    ("z_acc", "G", "101: acc", 4),
    ("x_rate_of_rotation", "deg/s", "102: gyro", 3),
    ("y_rate_of_rotation", "deg/s", "102: gyro", 3),
    ("z_rate_of_rotation", "deg/s", "102: gyro", 3),
)


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """start_s: Unix time of the first row."""
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
            none = np.full(len(block.t_s), np.nan)
            table = np.column_stack(
                (
                    block.t_s + start_s,
                    np.zeros(len(none)),
                    none,
                    block.t_s,
                    block.lat_deg,
                    block.lon_deg,
                    block.speed_mps,
                    block.lateral_g,
                    block.lean_deg,
                    block.forward_g,
                    block.left_g,
                    block.up_g,
                    block.forward_g,
                    -block.pitch_rate_dps,
                    block.yaw_rate_dps,
                    block.roll_rate_dps,
                )
            )
            file.writelines(csv_lines(table, [column[3] for column in COLUMNS]))
