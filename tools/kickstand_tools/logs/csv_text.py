"""Reads and writes CSV: logs and the tables of other apps.

Each line is one row, so an unclosed quotation mark does not affect the following lines. In a log, the first mistake
raises an error that names the line. In another app's table, damaged rows are left out and counted. Memory is limited: a
log is read in blocks (see source.chunks()), and a table has a maximum number of cells.

Kickstand's own logs contain only plain numbers. numbers_in() reads an hour of such a log at 200 Hz in 0.7 s, where
numbers_by_line(), which reads any log, takes 1.7 s.
"""

import csv
import io
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.messages import InputError, Remedy
from ..common.output import write_packed
from ..signals import Array, Bools

# The n cells of one column. The type is int64, or float64 with NaN for an empty cell, or object with a str per cell, ""
# for an empty cell.
Cells = NDArray[Any]

ROWS = 50_000  # rows converted at once; as text they take ten times the memory of the numbers
LONGEST = 40  # most characters in a number
LONGEST_LINE = 100_000  # most characters in a line; Python's csv module refuses a cell over 131072 characters
# Most cells of a table, and most cells with text. The first limit is seven hours of twelve columns at 100 Hz. A number
# uses 8 bytes, and 8 more while the parts of a column are joined. A string object uses 60 bytes.
MOST_CELLS, MOST_TEXTS = 30_000_000, 3_000_000
_NOTHING = {"", "-", "na", "n/a", "nan", "nil", "none", "null", "#n/a"}
_PLAIN = b"0123456789.-,\n"

COLUMNS = ("t_s", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps")
# Columns from a satellite receiver. Only some rows have values, because the receiver is slower than the sensor.
TRACK = ("speed_mps", "lat_deg", "lon_deg", "utc_s")
OPTIONAL = (*TRACK, "temp_c")  # columns that may be missing or have empty cells

# The sensor's widest ranges are 16 g and 2000 deg/s. Values over these limits are in another unit (m/s2, counts).
MOST_G, MOST_DPS = 20.0, 2500.0
_LIMITS = {"t_s": 1e10, "ax_g": MOST_G, "ay_g": MOST_G, "az_g": MOST_G, "temp_c": 200.0, "speed_mps": 200.0}
_LIMITS |= {"gx_dps": MOST_DPS, "gy_dps": MOST_DPS, "gz_dps": MOST_DPS}
_LIMITS |= {"lat_deg": 90.0, "lon_deg": 180.0, "utc_s": 1e10}
_UNITS = {"t_s": "seconds", "temp_c": "degrees Celsius", "speed_mps": "m/s"}
_UNITS |= {"ax_g": "g", "ay_g": "g", "az_g": "g", "gx_dps": "deg/s", "gy_dps": "deg/s", "gz_dps": "deg/s"}
_UNITS |= {"lat_deg": "degrees", "lon_deg": "degrees", "utc_s": "seconds since 1970"}

_AS_EXPORTED = "give it as the app has exported it"

_LINES_AT_ONCE = 15_000  # number of rows that are formatted at once


def separator_of(line: str) -> str:
    """Find the separator of a line's cells: the most frequent of comma, semicolon and tab outside quotation marks."""
    bare = re.sub(r'"[^"]*"', "", line)
    return max(",;\t", key=bare.count)


def cells_of(line: str, separator: str = ",") -> list[str]:
    """The cells of one line. Raises csv.Error for a line of over LONGEST_LINE characters."""
    if len(line) > LONGEST_LINE:
        raise csv.Error(f"a line of over {LONGEST_LINE} characters")
    if '"' not in line:  # split() takes half the time of the csv module
        return line.split(separator)
    return next(csv.reader((line,), delimiter=separator, skipinitialspace=True), [])


def number_of(cell: str) -> float | None:
    """Convert a cell to a number; None for text and for an empty cell. Python would read 1_0 as 10."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None


def numbers_in(text: bytes, count: int) -> Array | None:
    """Convert n lines of `count` plain numbers as float() does, NaN for an empty cell; None for other text."""
    if text.translate(None, _PLAIN) or not text.strip(b"\n"):
        return None
    if max(map(len, text.split(b"\n"))) > LONGEST_LINE:
        return None
    text = text if text.endswith(b"\n") else text + b"\n"
    filled_up = b"\n" + text
    for empty in (b",,", b",,", b",\n", b"\n,"):  # b",,": replaced twice, because adjacent empty cells share a comma
        filled_up = filled_up.replace(empty, empty[:1] + b"nan" + empty[1:])
    try:
        table = np.loadtxt(io.BytesIO(filled_up), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return table if table.shape == (text.count(b"\n"), count) else None  # loadtxt skips empty lines


def columns_of_text(text: str, separator: str, width: int, most: int = 0) -> tuple[list[Cells], int]:
    """Read CSV without a header. Returns the cells of each column, and the number of damaged rows, which are left out.

    A row is damaged if its line is too long, or if it has more than `most` cells. If `most` is 0, a row may have
    `width` cells, or as many as the first row. The missing cells of a short row are empty. Raises InputError as
    columns_of().
    """
    left_out = 0

    def whole() -> Iterator[list[str]]:
        nonlocal most, left_out
        for line in _lines(text):
            try:
                row = cells_of(line.replace('"', "") if line.count('"') % 2 else line, separator)
            except csv.Error:
                row = None
            most = most or max(width, len(row or ()))
            if row is None or len(row) > most:
                left_out += 1
            else:
                yield row

    return columns_of(whole(), width), left_out


def _lines(text: str) -> Iterator[str]:
    """Yield the lines that are not blank. A list of all lines would use several times the memory of the text."""
    begin = 0
    while begin < len(text):
        end = text.find("\n", begin)
        end = len(text) if end < 0 else end
        if line := text[begin:end].strip():
            yield line
        begin = end + 1


def columns_of(rows: Iterable[Sequence[str]], width: int) -> list[Cells]:
    """Convert rows of cells to `width` columns. Raises InputError for a table that is too large."""
    parts: list[list[Cells]] = [[np.empty(0, dtype=np.int64)] for _ in range(width)]
    rows, cells_read, texts = iter(rows), 0, 0
    while block := list(itertools.islice(rows, max(1, min(ROWS, 20 * ROWS // max(1, width))))):
        cells_read += width * len(block)
        if cells_read > MOST_CELLS or texts > MOST_TEXTS:
            raise InputError(
                f"the table is too large: over {MOST_CELLS / 1e6:.0f} million cells, or {MOST_TEXTS / 1e6:.0f} million "
                "of text: give a part of it"
            )
        short = any(len(row) < width for row in block)
        filled = [[*row, *[""] * (width - len(row))] for row in block] if short else block
        for part, cells in zip(parts, zip(*filled)):
            part.append(_typed(cells))
            texts += len(cells) if part[-1].dtype.kind == "O" else 0
    return [_joined(part) for part in parts]


def numbers_of(cells: Cells) -> NDArray[Any]:
    """Convert the cells of a column to numbers: integers if all are integers, otherwise floats, NaN for text."""
    if cells.dtype.kind in "iuf":
        return cells
    numbers = [_number(str(cell)) for cell in cells.tolist()]
    return np.array([np.nan if number is None else number for number in numbers], dtype=float)


def filled(cells: Cells) -> Bools:
    """Return True for each cell that is not empty, shape (n)."""
    if cells.dtype.kind in "iuf":
        return ~np.isnan(cells.astype(float))
    return np.array([cell != "" for cell in cells.tolist()], dtype=bool)


def as_text(cells: Cells) -> list[str]:
    return ["" if cell != cell else str(cell) for cell in cells.tolist()]


def _typed(cells: Sequence[str]) -> Cells:
    if max(map(len, cells)) <= LONGEST and not any("_" in cell for cell in cells):  # Python reads 1_0 as 10
        text = np.array(cells)
        for kind in (np.int64, np.float64):
            try:
                return text.astype(kind)
            except (ValueError, OverflowError):
                continue
    numbers = [_number(cell) for cell in cells]
    if None not in numbers:
        return np.array(numbers, dtype=float)
    return _text("" if number is not None and number != number else cell for number, cell in zip(numbers, cells))


def _joined(parts: list[Cells]) -> Cells:
    parts = [part for part in parts if len(part)] or parts[:1]
    if all(part.dtype.kind != "O" for part in parts):
        return np.concatenate(parts)
    return _text(itertools.chain.from_iterable(map(as_text, parts)))


def _text(cells: Iterable[str]) -> Cells:
    return np.array(list(cells), dtype=object)


def _number(cell: str) -> float | None:
    """Convert a cell to a number. An empty cell becomes NaN. Returns None for text."""
    return np.nan if cell.strip().lower() in _NOTHING else number_of(cell)


def check_text(log: str, content: bytes, lines_before: int) -> None:
    """Raise InputError if the bytes are not UTF-8. log: the log's name in messages."""
    try:
        content.decode()
    except UnicodeDecodeError as error:
        line = lines_before + content.count(b"\n", 0, error.start) + 1
        if content.startswith(b"PK\x03\x04"):
            import_it = Remedy("if an app has exported it, kickstand import makes a log of it", _AS_EXPORTED)
            raise InputError(f"{log} is a zip", import_it) from None
        raise InputError(f"{log}, line {line}: not text: give a log as CSV or as .csv.gz") from error


def header_names(log: str, line: str) -> list[str]:
    """Return the names of the columns. Raises InputError if one is missing or present twice."""
    try:
        names = [name.strip() for name in cells_of(line)]
    except csv.Error as error:
        raise InputError(f"{log}, line 1: not CSV ({error}): is it a log?") from error
    missing = [name for name in COLUMNS if name not in names]
    if missing and log.lower().endswith((".gpx", ".fit")):
        raise InputError(f"{log} is a track: kickstand join adds it to a ride")
    if missing and log.lower().endswith(".json"):
        raise InputError(f"{log} is not a log: give the ride, and a calibration with --calibration")
    if missing and "lean_deg" in names:
        what = f"{log} contains a lean but no readings"
        raise InputError(f"{what}: give the log that it was made from{_made_from(log)}")
    if missing and any(mark in "".join(names) for mark in ";\t"):
        raise InputError(f"{log}, line 1: values are separated by ; or tab: save it with commas between them")
    if missing:
        raise InputError(
            f"{log}, line 1: no column {', '.join(missing)}, and a log starts with {','.join(COLUMNS)}",
            Remedy("an app's export has to go through kickstand import first", _AS_EXPORTED),
        )
    for name in COLUMNS + OPTIONAL:
        if names.count(name) > 1:
            raise InputError(f"{log}, line 1: column {name} exists twice: remove one")
    return names


def _made_from(log: str) -> str:
    """Return ", RIDE.csv" if the log's folder has exactly one other ride with a calibration, otherwise ""."""
    rides = [
        path.with_name(path.name.removesuffix(".cal.json") + ending)
        for path in Path(log).parent.glob("*.cal.json")
        for ending in (".csv", ".csv.gz")
    ]
    logs = [path for path in rides if path.is_file() and path != Path(log)]
    return f", {logs[0]}" if len(logs) == 1 else ""


def is_plausible(table: Array, names: list[str], before_us: int | None) -> bool:
    """Return True if numbers_by_line() would accept these values.

    table: one column per name, NaN for an empty cell, shape (n, number of names).
    before_us: time of the previous sample, None for the first.
    """
    for k, name in enumerate(names):
        within = np.abs(table[:, k]) <= _LIMITS[name]
        if not np.all(within | np.isnan(table[:, k]) if name in OPTIONAL else within):
            return False
    time_us = np.rint(table[:, 0] * 1e6)
    return bool(np.all(np.diff(time_us) >= 0) and (before_us is None or time_us[0] >= before_us))


def numbers_by_line(
    log: str, text: str, width: int, places: dict[str, int], lines_before: int, before_us: int | None
) -> Array:
    """Convert the text of n rows to numbers. An empty cell in an optional column becomes NaN.

    width: number of cells per row.
    places: index of each column in a row, by its name.
    lines_before: number of lines before the text.
    before_us: time of the previous sample, None for the first.
    Returns the columns in the order of places, shape (n, number of places). Raises InputError for the first mistake and
    names its line.
    """
    columns = [(index, name, _LIMITS[name]) for name, index in places.items()]
    values = []
    for number, line in enumerate(text.split("\n"), lines_before + 1):
        if not line.strip():
            continue  # the text often ends in a line feed
        try:
            cells = cells_of(line)
            if len(cells) != width:
                raise ValueError(f"{len(cells)} values under {width} column names: is the line cut?")
            value = [_limited_number(cells[index], name, limit) for index, name, limit in columns]
            now = round(value[0] * 1e6)
            if before_us is not None and now < before_us:
                text_s = cells[places["t_s"]].strip()
                raise ValueError(f"time goes back from {before_us / 1e6:.6f} at {text_s} s: it must increase")
        except csv.Error as error:
            raise InputError(f"{log}, line {number}: not CSV ({error}): is it a log?") from error
        except ValueError as mistake:
            raise InputError(f"{log}, line {number}: {mistake}") from None
        before_us = now
        values.append(value)
    return np.reshape(np.array(values, dtype=float), (-1, len(places)))


def _limited_number(cell: str, name: str, limit: float) -> float:
    """The value of a cell; NaN for an empty cell in a column of OPTIONAL. Raises ValueError."""
    value = number_of(cell)
    if value is not None and abs(value) <= limit:
        return value
    if name in OPTIONAL and not cell.strip():
        return math.nan
    if value is None:
        raise ValueError(f"{name} is {_shown(cell)}, not a number")
    if not math.isfinite(value):
        raise ValueError(f"{name} is {_shown(cell)}: a number is needed")
    raise ValueError(f"{name} is {_shown(cell)}, past any reading: its unit is {_UNITS[name]}")


def _shown(cell: str) -> str:
    text = cell.strip()
    return ascii(text if len(text) <= 20 else text[:20] + "...") if text else "empty"


def csv_lines(table: Array, digits: Sequence[int]) -> Iterator[bytes]:
    """Yield the lines of a table, many lines at a time, with these numbers of decimals. NaN becomes an empty cell."""
    line = _line_form(digits)
    for begin in range(0, len(table), _LINES_AT_ONCE):
        text = "".join([line % tuple(row) for row in table[begin : begin + _LINES_AT_ONCE].tolist()])
        yield text.replace("nan", "").encode()


def _line_form(digits: Sequence[int]) -> str:
    return ",".join(f"%.{digit}f" for digit in digits) + "\n"


def write_lines(path: Path, names: Sequence[str], lines: Iterable[bytes]) -> None:
    """Write a CSV file from its columns' names and its lines, as write_packed() does. Raises InputError."""
    write_packed(path, itertools.chain([(",".join(names) + "\n").encode()], lines))


def write_lean(
    out: Path, columns: Sequence[str], digits: Sequence[int], times: Iterator[str], parts: Iterable[Array]
) -> int:
    """Write a LEAN.csv with the log's own times as the first column. Returns the number of samples. Raises InputError.

    columns, digits: names of the other columns, and their numbers of decimals.
    times: the log's own time of each sample, as text.
    parts: values of successive samples, shape (n, number of columns).
    """
    count, line = 0, "%s," + _line_form(digits)

    def lines() -> Iterator[bytes]:
        nonlocal count
        for values in parts:
            count += len(values)
            # values.tolist() is first, so that zip() takes no further time from `times` at its end
            lines = [line % (time, *row) for row, time in zip(values.tolist(), times)]
            yield "".join(lines).encode()

    write_lines(out, ("t_s", *columns), lines())
    return count


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV file of texts and numbers that need no quotation marks. See write_lines()."""
    write_lines(path, columns, (",".join(map(str, row)).encode("ascii") + b"\n" for row in rows))
