"""Reads CSV: logs and the tables of other apps.

Each line is one row, so an unclosed quotation mark does not affect the following lines. In a log, the first mistake
raises an error that names the line (see cells.read()). In another app's table, damaged rows are left out and counted
(see columns_of_text()).

Memory is limited in both cases. A log is read in blocks (see source.chunks()), and a table has a maximum number of
cells.

Kickstand's own logs contain only plain numbers. numbers_in() reads an hour of such a log at 200 Hz in 0.7 s.
cells.read() reads any log, and takes 1.7 s for an hour.
"""

import csv
import io
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.messages import InputError
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
    """Convert n lines of `count` plain numbers, as float() does. An empty cell becomes NaN.

    Returns the numbers, shape (n, count), or None if the text contains anything else. Then the caller must use another
    reader.
    """
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
    """Read CSV without a header.

    A damaged row is left out. A row is damaged if its line is too long, or if it has more than `most` cells. If `most`
    is 0, a row may have `width` cells, or as many as the first row. The missing cells of a short row are empty.

    Returns:
        columns: the cells of each column.
        left_out: number of damaged rows.

    Raises InputError for a table that is too large.
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
    """Convert the cells of a column to numbers: integers if all are integers, otherwise floats.

    A cell that is not a number becomes NaN.
    """
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
    """The cells as text, "" for an empty cell."""
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
