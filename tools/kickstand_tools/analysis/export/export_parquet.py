"""Apache Parquet for data frames: the columns of export_csv.py, each field with its unit in its metadata.

https://arrow.apache.org/docs/python/parquet.html; pandas.read_parquet and others open it.
"""

from collections.abc import Iterator
from pathlib import Path

from ..channels import Channels
from .export_csv import COLUMNS

_FINE = ("t_s", "lat_deg", "lon_deg", "utc_s")  # a float of 32 bits has positions to 1 m only


def write(path: Path, blocks: Iterator[Channels], start_s: float) -> None:
    """Write the file: one row group per block; times and positions in 64-bit floats, the rest in 32-bit floats. NaN
    where there is no value."""
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    schema = pyarrow.schema(
        [
            pyarrow.field(name, pyarrow.float64() if name in _FINE else pyarrow.float32(), metadata={"unit": unit})
            for name, (_, unit) in COLUMNS.items()
        ],
        metadata={"made_by": "kickstand", "axes": "left, up, forward; lean > 0 to the right"},
    )
    with ParquetWriter(path, schema) as writer:
        for block in blocks:
            block.t_s = block.t_s + start_s
            columns = [pyarrow.array(getattr(block, field.name), type=field.type) for field in schema]
            writer.write_table(pyarrow.table(columns, schema=schema))
