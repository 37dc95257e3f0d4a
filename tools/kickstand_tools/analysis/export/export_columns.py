"""Writes Kickstand's own columns: the calibrated log in the vehicle's axes, and the lean that the display shows.

The file is CSV or Apache Parquet. In Parquet, the metadata of each field has its unit. pandas.read_parquet opens the
file: https://arrow.apache.org/docs/python/parquet.html
"""

import gzip
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...logs.csv_lines import csv_lines
from ...logs.log import float_schema
from ..channels import Channels

# Number of decimals and unit of each column.
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


_FINE = ("t_s", "lat_deg", "lon_deg", "utc_s")  # 64-bit floats, because a 32-bit float resolves positions only to 1 m


def write_csv(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write CSV, gzipped if the name ends in .gz."""
    opened = gzip.open if path.suffix == ".gz" else open
    digits = [digit for digit, _ in COLUMNS.values()]
    with opened(path, "wb") as file:
        file.write((",".join(COLUMNS) + "\n").encode("ascii"))
        for block in blocks:
            block.t_s = block.t_s + start_s
            file.writelines(csv_lines(np.column_stack([getattr(block, name) for name in COLUMNS]), digits))


def write_parquet(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write Parquet, one row group per block.

    Times and positions are 64-bit floats, all other columns 32-bit floats. A missing value is NaN.
    """
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    about = {"made_by": "kickstand", "axes": "left, up, forward; lean > 0 to the right"}
    schema = float_schema({name: unit for name, (_, unit) in COLUMNS.items()}, _FINE, about)
    with ParquetWriter(path, schema) as writer:
        for block in blocks:
            block.t_s = block.t_s + start_s
            columns = [pyarrow.array(getattr(block, field.name), type=field.type) for field in schema]
            writer.write_table(pyarrow.table(columns, schema=schema))
