"""The cells of a table as columns: each of whole numbers, of floats, or of text."""

import csv
import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Cells = NDArray[Any]  # (n): int64; float64, NaN where there is no number; or str as objects, "" where there is nothing

ROWS = 50_000  # at once: text takes ten times the memory of numbers
LONGEST = 40  # characters of a number
LONGEST_LINE = 100_000  # characters: Python's csv refuses cells that are not much longer
# Of a table: seven hours of twelve columns at 100 Hz. Numbers take 8 bytes each, and as many while they are joined,
# texts 60.
MOST_CELLS, MOST_TEXTS = 30_000_000, 3_000_000
_NOTHING = {"", "-", "na", "n/a", "nan", "nil", "none", "null", "#n/a"}


def columns_of_text(text: str, separator: str, width: int) -> tuple[list[Cells], int]:
    """The columns of CSV without a header, and how many rows were left out.

    Each line is a row by itself: a quotation mark that is not closed does not swallow those after it. Rows with more
    cells than names or than the first row has are damaged, and left out; the ends of short ones are empty. Raises
    InputError for a table that is too large.
    """
    rows = (_cells(line, separator) for line in _lines(text) if line.strip())
    first = next(rows, [])
    most, left_out = max(width, len(first)), 0

    def whole() -> Iterator[list[str]]:
        nonlocal left_out
        for row in itertools.chain([first], rows):
            if len(row) <= most:
                yield row
            else:
                left_out += 1

    columns = columns_of(whole(), width)
    return columns, left_out


def _lines(text: str) -> Iterator[str]:
    """One after the other: a list of all takes several times the memory of the text."""
    begin = 0
    while begin < len(text):
        end = text.find("\n", begin)
        end = len(text) if end < 0 else end
        yield text[begin:end]
        begin = end + 1


def _cells(line: str, separator: str) -> list[str]:
    if line.count('"') % 2:
        line = line.replace('"', "")
    if len(line) > LONGEST_LINE:
        return line.split(separator, LONGEST_LINE)  # more than any table has columns
    return next(csv.reader((line,), delimiter=separator, skipinitialspace=True))


def columns_of(rows: Iterable[Sequence[str]], width: int) -> list[Cells]:
    """The columns of rows of cells."""
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
    """Cells (n) as whole numbers where all of them are, else as floats, NaN for what is no number."""
    if cells.dtype.kind in "iuf":
        return cells
    numbers = [_number(str(cell)) for cell in cells.tolist()]
    return np.array([np.nan if number is None else number for number in numbers], dtype=float)


def filled(cells: Cells) -> NDArray[np.bool_]:
    """(n) True where there is something in the cell."""
    if cells.dtype.kind in "iuf":
        return ~np.isnan(cells.astype(float))
    return np.array([cell != "" for cell in cells.tolist()], dtype=bool)


def as_text(cells: Cells) -> list[str]:
    """The cells as text, "" where there is nothing."""
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
    """NaN where there is nothing; None for text."""
    cell = cell.strip()
    if cell.lower() in _NOTHING:
        return np.nan
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
