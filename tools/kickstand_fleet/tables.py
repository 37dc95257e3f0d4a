"""Writes the tables of a fleet as Parquet, and defines their columns, types and units.

Angles about an axis follow the right-hand rule.
"""

import contextlib
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

from kickstand_tools.common.errors import InputError, extra

from . import files
from .period import PeriodResult, Row

if TYPE_CHECKING:
    import pyarrow

_GROUP = 20_000  # number of rows that are written at a time
_TEXT, _NUMBER, _COUNT, _LIST = "string", "double", "int32", "list"

# Each column with its type, unit and meaning
_WHOSE = {
    "vehicle": (_TEXT, "", "as in the manifest"),
    "mount": (_TEXT, "", "as in the manifest, empty if it has none"),
}
TABLES: dict[str, dict[str, tuple[str, str, str]]] = {
    "alignments": _WHOSE
    | {
        "kind": (_TEXT, "", "motorcycle or car"),
        "status": (_TEXT, "", "aligned; refused: the drives do not show it; error: no log could be used"),
        "reason": (_TEXT, "", "why not aligned, a code; empty if aligned"),
        "message": (_TEXT, "", "the reason in words"),
        "quality_deg": (_NUMBER, "deg", "standard error of forward about the vertical"),
        "attitude_deg": (_NUMBER, "deg", "standard error of the whole alignment, up included"),
        "halves_deg": (_NUMBER, "deg", "forward of the first half of the driving against the second"),
        "vehicle_from_sensor": (_LIST, "", "9 numbers, rows left, up, forward; null if not aligned"),
        "gyro_bias_dps": (_LIST, "deg/s", "3 numbers, along the sensor's axes"),
        "speed_lag_s": (_NUMBER, "s", "by how much the speed is late"),
        "stops": (_COUNT, "", "standstills used for the vertical"),
        "events_used": (_COUNT, "", "straight braking and speeding-up events that count"),
        "events_in_turns": (_COUNT, "", "braking events that do not count because of a turn"),
        "logs": (_COUNT, "", "logs that were used"),
        "logs_left_out": (_COUNT, "", "logs that were not, see errors"),
        "driven_s": (_NUMBER, "s", "length of the logs that were used"),
        "start_utc_s": (_NUMBER, "s since 1970", "Universal Time at the first log's beginning, null if it has none"),
        "plot": (_TEXT, "", "path of its picture, seen from this table"),
    },
    "moved": _WHOSE
    | {
        "log": (_TEXT, "", "the log in which it moved, or the first one after it"),
        "within_log": ("bool", "", "true: during that log; false: before it"),
        "at_s": (_NUMBER, "s", "when in the log, null if before it"),
        "utc_s": (_NUMBER, "s since 1970", "Universal Time of that, null if the log has none"),
        "turned_deg": (_NUMBER, "deg", "by how much the sensor turned"),
        "turned_sigma_deg": (_NUMBER, "deg", "its standard deviation"),
        "sigmas": (_NUMBER, "", "by how many standard deviations it differs from not having moved"),
        "about_left_deg": (_NUMBER, "deg", "the turn's part about left"),
        "about_up_deg": (_NUMBER, "deg", "about up"),
        "about_forward_deg": (_NUMBER, "deg", "about forward"),
    },
    "brake_tests": _WHOSE
    | {
        "log": (_TEXT, "", "path of the log"),
        "start_s": (_NUMBER, "s", "beginning of the braking, from the log's first sample"),
        "utc_s": (_NUMBER, "s since 1970", "Universal Time of that, null if the log has none"),
        "initial_speed_mps": (_NUMBER, "m/s", "when braking begins"),
        "duration_s": (_NUMBER, "s", "until the standstill"),
        "distance_m": (_NUMBER, "m", "until the standstill"),
        "mfdd_mps2": (_NUMBER, "m/s2", "mean fully developed deceleration, UN Regulation No. 13, Annex 4"),
        "peak_mps2": (_NUMBER, "m/s2", "largest deceleration"),
        "jerk_mps3": (_NUMBER, "m/s3", "largest change of deceleration, either way"),
        "side_m": (_NUMBER, "m", "pulled off the straight line, > 0 to the left"),
        "heading_deg": (_NUMBER, "deg", "turned while braking, > 0 to the left"),
        "speed_from": (_TEXT, "", "log, or integrated from the acceleration"),
    },
    "errors": _WHOSE
    | {
        "log": (_TEXT, "", "path of the log, empty if all of them are meant"),
        "reason": (_TEXT, "", "a code"),
        "message": (_TEXT, "", "the reason in words"),
    },
}


def schema(table: str) -> "pyarrow.Schema":
    """Return the Arrow schema of one of TABLES. The metadata of each column contains its unit and meaning."""
    import pyarrow

    def arrow(kind: str) -> pyarrow.DataType:
        return pyarrow.list_(pyarrow.float64()) if kind == _LIST else pyarrow.type_for_alias(kind)

    return pyarrow.schema(
        [
            pyarrow.field(name, arrow(kind), metadata={"unit": unit, "meaning": meaning})
            for name, (kind, unit, meaning) in TABLES[table].items()
        ],
        metadata={"made_by": "kickstand fleet"},
    )


def check() -> None:
    """Raise InputError if Parquet cannot be written."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise InputError("a fleet needs pyarrow: " + extra("fleet")) from error


def write_tables(directory: str, results: Iterable[PeriodResult]) -> None:
    """Write a file NAME.parquet for each of TABLES. Each file is written completely or not at all.

    The results are read only once, and memory does not grow with their number. Raises InputError if a file cannot be
    written.
    """
    with contextlib.ExitStack() as opened:
        tables = {name: opened.enter_context(_table(directory, name)) for name in TABLES}
        for result in results:
            for name, add in tables.items():
                add([result.alignment] if name == "alignments" else getattr(result, name))


@contextlib.contextmanager
def _table(directory: str, name: str) -> Iterator[Callable[[list[Row]], None]]:
    """A context that yields a function. The function adds rows to the file of a table, and writes them in groups."""
    from pyarrow import Table
    from pyarrow.parquet import ParquetWriter

    columns = schema(name)
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
