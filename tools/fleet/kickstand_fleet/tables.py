"""Writes the tables of a fleet as Parquet, and defines their columns, types and units.

Angles about an axis follow the right-hand rule.
"""

import contextlib
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

from . import files
from .period import PeriodResult, Row

if TYPE_CHECKING:
    import pyarrow

_GROUP = 20_000  # number of rows that are written together
_TEXT, _NUMBER, _COUNT, _LIST = "string", "double", "int32", "list"

# Each column with its type, unit and meaning
_WHOSE = {
    "vehicle": (_TEXT, "", "name of the vehicle in the manifest"),
    "mount": (_TEXT, "", "name of the mount in the manifest, empty if the manifest gives none"),
}
TABLES: dict[str, dict[str, tuple[str, str, str]]] = {
    "alignments": _WHOSE
    | {
        "kind": (_TEXT, "", "motorcycle or car"),
        "status": (_TEXT, "", "aligned; refused: the drives do not determine it; error: no log could be used"),
        "reason": (_TEXT, "", "code of the reason why the vehicle is not aligned, empty if it is aligned"),
        "message": (_TEXT, "", "the reason in words"),
        "quality_deg": (_NUMBER, "deg", "standard error of forward about the vertical"),
        "attitude_deg": (_NUMBER, "deg", "standard error of the whole alignment, including up"),
        "halves_deg": (_NUMBER, "deg", "angle between forward from the first half of the driving and from the second"),
        "vehicle_from_sensor": (_LIST, "", "rotation matrix of 9 numbers, rows left, up, forward; null if not aligned"),
        "gyro_bias_dps": (_LIST, "deg/s", "bias of the gyro, 3 numbers along the sensor's axes"),
        "speed_lag_s": (_NUMBER, "s", "delay of the speed"),
        "stops": (_COUNT, "", "number of standstills used for the vertical"),
        "events_used": (_COUNT, "", "number of times the vehicle braked or sped up in a straight line"),
        "events_in_turns": (_COUNT, "", "number of braking events in turns, which are not used"),
        "logs": (_COUNT, "", "number of logs that were used"),
        "logs_left_out": (_COUNT, "", "number of logs that were not used, see errors"),
        "driven_s": (_NUMBER, "s", "total duration of the logs that were used"),
        "start_utc_s": (_NUMBER, "s since 1970", "Universal Time at the start of the first log, null if unknown"),
        "plot": (_TEXT, "", "path of the vehicle's picture, relative to this table's directory"),
    },
    "moved": _WHOSE
    | {
        "log": (_TEXT, "", "the log in which the mount moved, or the first log after it moved"),
        "within_log": ("bool", "", "true if the mount moved during this log, false if it moved before this log"),
        "at_s": (_NUMBER, "s", "time of the move in the log, null if the mount moved before the log"),
        "utc_s": (_NUMBER, "s since 1970", "Universal Time of the move, null if unknown"),
        "turned_deg": (_NUMBER, "deg", "angle by which the sensor turned"),
        "turned_sigma_deg": (_NUMBER, "deg", "standard deviation of turned_deg"),
        "sigmas": (_NUMBER, "", "size of the turn in standard deviations"),
        "about_left_deg": (_NUMBER, "deg", "component of the turn about left"),
        "about_up_deg": (_NUMBER, "deg", "component of the turn about up"),
        "about_forward_deg": (_NUMBER, "deg", "component of the turn about forward"),
    },
    "brake_tests": _WHOSE
    | {
        "log": (_TEXT, "", "path of the log"),
        "start_s": (_NUMBER, "s", "start of the braking, from the log's first sample"),
        "utc_s": (_NUMBER, "s since 1970", "Universal Time at the start of the braking, null if unknown"),
        "initial_speed_mps": (_NUMBER, "m/s", "speed at the start of the braking"),
        "duration_s": (_NUMBER, "s", "time from the start of the braking to the standstill"),
        "distance_m": (_NUMBER, "m", "distance from the start of the braking to the standstill"),
        "mfdd_mps2": (_NUMBER, "m/s2", "mean fully developed deceleration, UN Regulation No. 13, Annex 4"),
        "peak_mps2": (_NUMBER, "m/s2", "largest deceleration"),
        "jerk_mps3": (_NUMBER, "m/s3", "largest rate of change of the deceleration, increasing or decreasing"),
        "side_m": (_NUMBER, "m", "deviation from the straight line, positive to the left"),
        "heading_deg": (_NUMBER, "deg", "change of heading while braking, positive to the left"),
        "speed_from": (_TEXT, "", "source of the speed: log, or integrated from the acceleration"),
    },
    "errors": _WHOSE
    | {
        "log": (_TEXT, "", "path of the log, empty if the error concerns all logs"),
        "reason": (_TEXT, "", "code of the reason"),
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


def write_tables(directory: str, results: Iterable[PeriodResult]) -> None:
    """Write a file NAME.parquet for each of TABLES, completely or not at all. Raises InputError.

    The results are read only once, and memory does not grow with their number.
    """
    with contextlib.ExitStack() as opened:
        tables = {name: opened.enter_context(_table(directory, name)) for name in TABLES}
        for result in results:
            for name, add in tables.items():
                add([result.alignment] if name == "alignments" else getattr(result, name))


@contextlib.contextmanager
def _table(directory: str, name: str) -> Iterator[Callable[[list[Row]], None]]:
    """A context that gives a function to add rows to a table. The file gets its name at the end, if no error occurs."""
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
