"""The results as Parquet."""

from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError, extra
from ..output import write_whole
from . import schema
from .period import PeriodResult, Row

_GROUP = 20_000  # rows that are written at a time


def check() -> None:
    """Raise InputError where Parquet cannot be written."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise InputError("a fleet needs pyarrow: " + extra("fleet")) from error


def write_table(path: Path, table: str, rows: Iterable[Row]) -> None:
    """Write one of schema.TABLES, whole or not at all; memory does not grow with its length. Raises InputError."""
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    columns = schema.schema(table)

    def write(temporary: Path) -> None:
        with ParquetWriter(temporary, columns, compression="zstd") as writer:
            group: list[Row] = []
            for row in rows:
                group.append(row)
                if len(group) == _GROUP:
                    writer.write_table(pyarrow.Table.from_pylist(group, schema=columns))
                    group = []
            writer.write_table(pyarrow.Table.from_pylist(group, schema=columns))

    write_whole(path, write)


def rows_of(results: Iterable[PeriodResult], table: str) -> Iterable[Row]:
    """The rows of one table."""
    for result in results:
        if table == "alignments":
            yield result.alignment
        else:
            yield from getattr(result, table)
