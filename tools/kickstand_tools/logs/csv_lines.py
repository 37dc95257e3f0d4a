"""Writes tables of numbers, logs in memory and stretches of logs as CSV."""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from ..common.output import write_packed
from ..signals import Array
from .cells import COLUMNS, OPTIONAL
from .log import Log
from .reader import read_log, text_rows
from .source import Progress

_DIGITS = {"speed_mps": 3, "temp_c": 2, "lat_deg": 7, "lon_deg": 7, "utc_s": 3}
_ROWS = 15_000  # rows formatted at once


def csv_lines(table: Array, digits: Sequence[int]) -> Iterator[bytes]:
    """Yield the lines of a table, many lines at a time.

    table: the numbers, shape (n, m). NaN becomes an empty cell.
    digits: number of decimals of each of the m columns.
    """
    line = _line(digits)
    for begin in range(0, len(table), _ROWS):
        text = "".join([line % tuple(row) for row in table[begin : begin + _ROWS].tolist()])
        yield text.replace("nan", "").encode()


def _line(digits: Sequence[int]) -> str:
    return ",".join(f"%.{digit}f" for digit in digits) + "\n"


def write_lines(path: Path, names: Sequence[str], lines: Iterable[bytes]) -> None:
    """Write a CSV file from its columns' names and its lines, as write_packed() does. Raises InputError."""
    write_packed(path, itertools.chain([(",".join(names) + "\n").encode()], lines))


def write_lean(
    out: Path, columns: Sequence[str], digits: Sequence[int], times: Iterator[str], parts: Iterable[Array]
) -> int:
    """Write a LEAN.csv with the log's own times as the first column.

    columns: names of the other columns.
    digits: number of decimals of each of these columns.
    times: the log's own time of each sample, as text.
    parts: values of successive samples, shape (n, number of columns).

    Returns the number of samples. Raises InputError.
    """
    count, line = 0, "%s," + _line(digits)

    def lines() -> Iterator[bytes]:
        nonlocal count
        for values in parts:
            count += len(values)
            # values.tolist() is first, so that zip() takes no further time from `times` at its end
            lines = [line % (time, *row) for row, time in zip(values.tolist(), times)]
            yield "".join(lines).encode()

    write_lines(out, ("t_s", *columns), lines())
    return count


def write_log(path: Path | str, log: Log) -> None:
    """Write a log in memory to a CSV file, gzipped if the name ends in .gz. Raises InputError.

    After an error, no incomplete file remains. Optional columns without any value are left out. The column t_s has the
    recorder's own time.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     write_log(Path(directory, "log.csv"), Log([0.0, 0.01], [[0.0, 1.0, 0.0]] * 2, [[0.0, 0.0, 0.0]] * 2))
    ...     print(Path(directory, "log.csv").read_text().splitlines()[1])
    0.000000,0.000000,1.000000,0.000000,0.000000,0.000000,0.000000
    """
    values = log.columns()
    values["t_s"] = values["t_s"] + log.start_s
    names = [*COLUMNS, *[name for name in OPTIONAL if np.any(np.isfinite(values[name]))]]
    digits = [_DIGITS.get(name, 6) for name in names]
    table = np.column_stack([values[name] for name in names])
    write_lines(Path(path), names, csv_lines(table, digits))


def cut_log(
    source: Path | str,
    out: Path,
    from_s: float | None = None,
    to_s: float | None = None,
    progress: Progress | None = None,
) -> tuple[int, float]:
    """Copy the lines of a stretch of a log to the file `out`, gzipped if its name ends in .gz. Raises InputError.

    After an error, no incomplete file remains.

    Args:
        from_s, to_s: limits of the stretch, see Stretch.
        progress: called with the bytes read and the bytes of the file.

    Returns the number of samples, and the time from the first to the last sample in s.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     log = Path(directory, "log.csv")
    ...     _ = log.write_text("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\\n0,0,1,0,0,0,0\\n1,0,1,0,0,0,0\\n")
    ...     cut_log(log, Path(directory, "cut.csv"), from_s=0.5)
    (1, 0.0)
    """
    log = read_log(source, 1, progress)
    rows = log.rows_between(from_s, to_s)
    copy_rows(source, out, rows)
    return rows.stop - rows.start, float(log.t_s[rows.stop - 1] - log.t_s[rows.start])


def copy_rows(source: Path | str, out: Path, rows: slice) -> None:
    """Copy the lines of some samples of a log to the file `out`, as cut_log()."""
    texts = text_rows(source)
    names, first = next(texts)

    def lines() -> Iterator[bytes]:
        begin, end = rows.start, rows.stop
        for many in itertools.chain([first], (many for _, many in texts)):
            yield "".join(f"{line}\n" for line in many[max(0, begin) : max(0, end)]).encode()
            begin, end = begin - len(many), end - len(many)

    write_lines(out, names, lines())


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file of texts and numbers that need no quotation marks. See write_lines(). Raises InputError."""
    write_lines(path, columns, (",".join(map(str, row)).encode("ascii") + b"\n" for row in rows))
