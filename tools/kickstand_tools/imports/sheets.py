"""Reads a table of text as columns of numbers: finds its separator, its decimal mark and its names."""

import csv
import os
import re
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..logs.csv_reader import Cells, cells_of, columns_of_text, numbers_of, separator_of
from ..signals import Array
from .files import RecordingFile
from .times import Nanoseconds, times_ns

LONG = 6  # a common beginning of several names with so many letters is not repeated
_DECIMAL_COMMA = re.compile(r"(?:^|[;\t\"])\s*[+-]?\d+,\d")


@dataclass
class Sheet:
    """name: the file's, for messages. columns: their names in the file, some perhaps twice. cells: those of each
    column. left_out: number of damaged rows."""

    name: str
    columns: list[str]
    cells: list[Cells]
    left_out: int = 0

    def place(self, *names: str) -> int | None:
        """Number of the first column of one of these names, compared by plain()."""
        wanted = [plain(name) for name in names]
        found = [plain(column) for column in self.columns]
        return next((found.index(name) for name in wanted if name in found), None)

    def axes(self, *names: str | tuple[str, ...]) -> tuple[list[int], list[str]]:
        """place() of each name, or of one of several names; and the (first) names of those that are missing."""
        each = [name if isinstance(name, tuple) else (name,) for name in names]
        found = {one[0]: self.place(*one) for one in each}
        places = [place for place in found.values() if place is not None]
        return places, [name for name, place in found.items() if place is None]

    def times(self, place: int, unit: str = "s") -> Nanoseconds:
        """A column as times (n). unit: of numbers, "" if it is to be found from them. Raises InputError."""
        return times_ns(self.cells[place], unit, self.name)

    def named(self, places: list[int]) -> str:
        """The file's name and those of some columns, for messages: without units, a common beginning only once."""
        names = [re.sub(r"[(\[].*?[)\]]", "", self.columns[place]).strip(" ,;") for place in places]
        same = len(os.path.commonprefix(names)) if len(names) > 2 else 0  # noqa: RUF071 - letters, no path
        if same > LONG:
            names[1:] = ["…" + name[same:] for name in names[1:]]
        return f"{self.name}: {', '.join(names)}"

    def numbers(self, place: int | None) -> Array:
        """A column as numbers (n), NaN where a cell has none; all NaN for None."""
        if place is None:
            return np.full(len(self.cells[0]), np.nan)
        return numbers_of(self.cells[place]).astype(float)

    def table(self, places: list[int]) -> Array:
        """Several columns as numbers (n, columns)."""
        return np.column_stack([self.numbers(place) for place in places])


def plain(name: str) -> str:
    """A column's name as names are compared: small letters and digits only, without its unit in brackets."""
    return re.sub(r"[^a-z0-9]", "", re.sub(r"[(\[].*?[)\]]", "", name).lower())


def unit_in(name: str) -> str:
    """The unit that stands in brackets in a column's name, "" for none."""
    found = re.search(r"[(\[]([^)\]]*)[)\]]\s*$", name)
    return found[1].strip() if found else ""


def names_in(line: str) -> list[str]:
    """The cells of a line of names, none of one that is blank or no CSV."""
    try:
        return [] if not line.strip() else [cell.strip() for cell in cells_of(line, separator_of(line))]
    except csv.Error:
        return []


def read_sheet(file: RecordingFile, header: int = 0, skipped: int = 0) -> Sheet:
    """The table of a file. header: number of the line of names; skipped: lines after it that are no data.

    Raises InputError where there is none.
    """
    lines = file.text.split("\n", header + skipped + 1)
    if len(lines) < header + skipped + 2 or not lines[-1].strip():
        raise InputError(f"{file.name}: no rows under the names of the columns: was anything recorded?")
    columns = names_in(lines[header])
    while columns and not columns[-1]:
        columns.pop()  # lines that end in a separator
    text, separator = lines[-1], separator_of(lines[header])
    if separator != "," and _DECIMAL_COMMA.search(text[:20000]):
        text = text.replace(",", ".")
    return Sheet(file.name, columns, *columns_of_text(text, separator, max(len(columns), 1)))
