"""Writes tables of numbers, logs in memory and stretches of logs as CSV.

The module formats a whole column at once. The text is the same as with Python's format(), in a seventh of the time.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..common.output import write_packed
from ..signals import Array
from .cells import COLUMNS, OPTIONAL
from .log import Log
from .reader import read_log, text_rows
from .source import Progress

_DIGITS = {"speed_mps": 3, "temp_c": 2, "lat_deg": 7, "lon_deg": 7, "utc_s": 3}
_ROWS = 15_000  # rows formatted at once; their text fits into a processor's cache
_MOST = 2.0**53  # largest value in units of its last decimal; above it, a double does not hold every whole number
_POINT, _MINUS, _ZERO, _COMMA, _END = b".-0,\n"

Letters = NDArray[np.uint8]  # ASCII letters of n texts, one text per column, shape (m, n); 0 means no letter


def csv_lines(table: Array, digits: Sequence[int]) -> Iterator[bytes]:
    """Yield the lines of a table, many lines at a time.

    table: the numbers, shape (n, m). NaN becomes an empty cell.
    digits: number of decimals of each of the m columns.
    """
    for begin in range(0, len(table), _ROWS):
        columns = table[begin : begin + _ROWS].T
        yield joined_cells([number_cells(column, digit, nan="") for column, digit in zip(columns, digits, strict=True)])


def joined_cells(columns: Sequence[Letters]) -> bytes:
    """Join columns of cells to lines of CSV."""
    n = columns[0].shape[1]
    comma, end = np.full((1, n), _COMMA, dtype=np.uint8), np.full((1, n), _END, dtype=np.uint8)
    parts = [part for letters in columns for part in (letters, comma)]
    return np.concatenate((*parts[:-1], end)).T.tobytes().translate(None, b"\0")


def text_cells(texts: Sequence[str]) -> Letters:
    """The letters of ASCII texts. Raises UnicodeEncodeError for other texts."""
    packed = np.array(texts, dtype=np.bytes_)
    return np.ascontiguousarray(packed.view(np.uint8).reshape(len(texts), packed.itemsize).T)


def number_cells(values: Array, digits: int, nan: str = "nan") -> Letters:
    """Format n values like f"{value:.{digits}f}". nan: the text for a value that is NaN."""
    scaled = np.abs(values) * 10.0**digits
    missing = np.isnan(scaled)
    scaled = np.where(missing, 0.0, scaled)
    if not np.all(scaled < _MOST):  # also for infinity
        return text_cells([nan if value != value else f"{value:.{digits}f}" for value in values.tolist()])
    integers = np.rint(scaled)
    # Rounding of the product can put a value that is almost halfway between two texts on the wrong side. Python's
    # format() decides these values.
    for k in np.flatnonzero(np.abs(np.abs(scaled - integers) - 0.5) <= scaled * 2.0**-52).tolist():
        integers[k] = int(f"{abs(values[k]):.{digits}f}".replace(".", ""))
    most = int(np.max(integers, initial=0.0))
    letters = _letters(integers.astype(np.uint32 if most < 2**32 else np.uint64), digits, len(str(most)), len(nan))
    letters[0] = np.where(np.signbit(values), _MINUS, 0)
    if np.any(missing):
        letters[:, missing] = np.array([*nan.encode(), *bytes(len(letters) - len(nan))], dtype=np.uint8)[:, None]
    return letters


def _letters(number: NDArray[np.unsignedinteger], digits: int, most: int, least_rows: int) -> Letters:
    """Format n integers with a decimal point before the last `digits` digits.

    most: largest number of digits of an integer.
    least_rows: smallest number of rows of the result.

    The first row of the result stays empty, because it is for the sign.
    """
    rows_needed = max(most, digits + 1)
    letters = np.zeros((max(rows_needed + 2, least_rows), len(number)), dtype=np.uint8)
    row = len(letters) - 1
    for power in range(rows_needed):
        if power == digits > 0:
            letters[row] = _POINT
            row -= 1
        rest = number // 10
        letter = (number - 10 * rest).astype(np.uint8) + np.uint8(_ZERO)
        letters[row] = letter if power <= digits else np.where(number > 0, letter, 0)  # no leading zeros
        number, row = rest, row - 1
    return letters


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
    count = 0

    def lines() -> Iterator[bytes]:
        nonlocal count
        for values in parts:
            count += len(values)
            cells = [number_cells(column, digit) for column, digit in zip(values.T, digits, strict=True)]
            yield joined_cells([text_cells(list(itertools.islice(times, len(values)))), *cells])

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
