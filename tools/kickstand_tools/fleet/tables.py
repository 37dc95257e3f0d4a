"""Writes the results as Parquet."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ..errors import InputError, extra
from . import files, schema
from .period import PeriodResult, Row

_GROUP = 20_000  # rows that are written at a time


def check() -> None:
    """Raise InputError where Parquet cannot be written."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise InputError("a fleet needs pyarrow: " + extra("fleet")) from error


def write_tables(directory: str, results: Iterable[PeriodResult]) -> None:
    """Write a file NAME.parquet for each of schema.TABLES, whole or not at all. Memory does not grow with the number of
    results, which are gone through once. Raises InputError."""
    _open_next(directory, list(schema.TABLES), {}, results)


def _open_next(directory: str, names: list[str], tables: dict[str, "_Table"], results: Iterable[PeriodResult]) -> None:
    """Open the table of the first name, then the others, then write all."""
    if not names:
        for result in results:
            for name, table in tables.items():
                table.add([result.alignment] if name == "alignments" else getattr(result, name))
        return
    from pyarrow.parquet import ParquetWriter

    name, *others = names
    columns = schema.schema(name)

    def write(temporary: Path) -> None:
        with ParquetWriter(temporary, columns, compression="zstd") as writer:
            tables[name] = _Table(writer, columns)
            _open_next(directory, others, tables, results)
            tables[name].flush()

    files.write_by(files.join(directory, f"{name}.parquet"), write)


class _Table:
    """Collects rows and writes them to a file in groups."""

    def __init__(self, writer: Any, columns: Any) -> None:
        self._writer, self._columns = writer, columns
        self._rows: list[Row] = []

    def add(self, rows: list[Row]) -> None:
        self._rows += rows
        if len(self._rows) >= _GROUP:
            self.flush()

    def flush(self) -> None:
        from pyarrow import Table

        self._writer.write_table(Table.from_pylist(self._rows, schema=self._columns))
        self._rows = []
