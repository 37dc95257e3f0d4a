"""Writes the results as Parquet."""

import contextlib
from collections.abc import Callable, Iterable, Iterator

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
    with contextlib.ExitStack() as opened:
        tables = {name: opened.enter_context(_table(directory, name)) for name in schema.TABLES}
        for result in results:
            for name, add in tables.items():
                add([result.alignment] if name == "alignments" else getattr(result, name))


@contextlib.contextmanager
def _table(directory: str, name: str) -> Iterator[Callable[[list[Row]], None]]:
    """A function that adds rows to the file of a table. It writes them in groups."""
    from pyarrow import Table
    from pyarrow.parquet import ParquetWriter

    columns = schema.schema(name)
    waiting: list[Row] = []

    def write() -> None:
        writer.write_table(Table.from_pylist(waiting, schema=columns))
        waiting.clear()

    def add(rows: list[Row]) -> None:
        waiting.extend(rows)
        if len(waiting) >= _GROUP:
            write()

    with (
        files.to_write(files.join(directory, f"{name}.parquet")) as temporary,
        ParquetWriter(temporary, columns, compression="zstd") as writer,
    ):
        yield add
        write()
