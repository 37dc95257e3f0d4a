"""Kickstand's own columns: the log calibrated and in the vehicle's axes, and the lean that the display shows."""

import gzip
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...logs.csv_lines import csv_lines
from ..channels import Channels

# name: (digits, unit)
COLUMNS = {
    "t_s": (6, "s"),
    "lean_deg": (3, "deg"),
    "lean_formula_deg": (3, "deg"),
    "left_g": (5, "g"),
    "up_g": (5, "g"),
    "forward_g": (5, "g"),
    "lateral_g": (5, "g"),
    "pitch_rate_dps": (4, "deg/s"),
    "yaw_rate_dps": (4, "deg/s"),
    "roll_rate_dps": (4, "deg/s"),
    "speed_mps": (3, "m/s"),
    "temp_c": (2, "Cel"),
    "shown_g": (5, "g"),
    "lean_sigma_deg": (3, "deg"),
    "lat_deg": (7, "deg"),
    "lon_deg": (7, "deg"),
    "utc_s": (3, "s"),
}


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Gzipped if the name ends in .gz."""
    opened = gzip.open if path.suffix == ".gz" else open
    digits = [digit for digit, _ in COLUMNS.values()]
    with opened(path, "wb") as file:
        file.write((",".join(COLUMNS) + "\n").encode("ascii"))
        for block in blocks:
            block.t_s = block.t_s + start_s
            file.writelines(csv_lines(np.column_stack([getattr(block, name) for name in COLUMNS]), digits))
