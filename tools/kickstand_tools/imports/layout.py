"""Finds the layout of a table of an unknown app: where the rows are, and to which sensor each cell belongs.

Any lines may come before the rows. Names above the rows are optional, and so is a line of units below the names. The
table may also be `label: value` texts of a serial monitor, with or without time stamps, in one or several lines per
sample. It may also have one row per event of a sensor, or one file per sensor.
"""

import itertools
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from ..common.messages import InputError
from ..logs.csv_text import Cells, columns_of, columns_of_text, filled, numbers_of, separator_of
from ..signals import Bools
from .columns import stated_unit
from .files import RecordingFile
from .recording import Sheet, cells_in, increases, plain
from .units import ACCELERATIONS, MOMENT, RATES, SPEEDS, TIME_NAME, TIMES, moment_of, tick_ns, times_ns, unit

LOOKED_AT = 400  # lines used to find the layout
SEPARATORS = "\t;, "  # if two separators split the same lines into the same number of cells, the first is used
FEWEST_CELLS = 4  # a row of a table of sensors has at least this many numbers: a time and three axes
MOST_KINDS = 20  # largest number of names of sensors or events in one column
EVENT = ":"  # separates a sensor's name from a column's name
_UNITS = {**ACCELERATIONS, **RATES, **SPEEDS, **TIMES}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_MARKS = " \t#%/;*'\"!"  # characters that begin a comment
_SENSOR_ID = re.compile(r"sensor|type|kind|event|source|device|imu|node|channel|addr|axis|field|^id$|^i$|instance")
_ARDUPILOT = re.compile(r"^FMT, *\d+, *\d+, *(\w+), *\w+, *(.+)$", re.MULTILINE)  # names of a message's columns
_WITH_UNIT = re.compile(r'^"?([^|"]*)"?\|"?([^|"]*)"?\|.*')  # RaceCapture: "AccelX"|"G"|-3.0|3.0|25
_STAMP = re.compile(r"^\s*(\d{1,2}:\d\d:\d\d[.,]\d+)\s*->\s*")
_STAMPED = "monitor_s"  # the name of the serial monitor's time
_PAIR = re.compile(
    r"(?P<label>[A-Za-z_][A-Za-z0-9_. /()\[\]]{0,40}?)[\"']?\s*[:=]\s*(?P<value>[+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)"
    r"(?![\d:])(?:\s*(?P<unit>[A-Za-zµ°][A-Za-z0-9/^²°]*)(?!\s*[:=]))?(?=[\s,;|}]|$)"
)
_SEVERAL = re.compile(r"([A-Za-z][\w/ ]*?)\s*[:=]\s*((?:[+-]?\d+(?:\.\d+)?[\s,;]+){2,}[+-]?\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Grid:
    """The layout of a table's rows."""

    names: int | None  # number of the line of names, None without such a line
    first: int  # number of the first row's line
    separator: str  # separates the cells, " " for any blanks
    width: int  # number of cells in a row


def sheet_in(file: RecordingFile, wanted: Collection[str] = ()) -> Sheet | None:
    """The table in a file; None without one. wanted: names that it must have. Raises InputError if it is too large."""
    text = without_stamps(file.text)
    labelled = _labelled(file.name, text)
    if labelled is not None:
        return labelled
    lines = text.split("\n", LOOKED_AT)[:LOOKED_AT]
    grid = _grid_below(lines, wanted) or find_grid(lines)
    if grid is None:
        return None
    # ArduPilot's names of columns, by the name of the message
    titles = {name: re.split(", *", columns) for name, columns in _ARDUPILOT.findall("\n".join(lines))}
    return _by_sensor(_read(file.name, text, lines, grid), titles)


def joined_sheet(files: list[RecordingFile]) -> Sheet | None:
    """Join the tables of several files, one per sensor. None if fewer than two are tables, or if two have one name.

    The columns are FILE:NAME, and each row comes from one file. The first column of each file is its time.
    """
    sheets = {PurePosixPath(file.name).name.partition(".")[0]: sheet_in(file) for file in files}
    parts = {name: sheet for name, sheet in sheets.items() if sheet is not None and len(sheet.columns) >= FEWEST_CELLS}
    if len(sheets) < len(files) or len(parts) < 2:
        return None
    clock = _joined_times(list(parts.values()))
    if clock is None:
        return None
    (clock_name, times), end = clock, 0
    columns, cells = [clock_name], [times]
    for name, sheet in parts.items():
        begin, end = end, end + len(sheet.cells[0])
        for column, values in zip(sheet.columns[1:], sheet.cells[1:]):
            if TIME_NAME.search(plain(column)):
                continue  # another time, which only the rows of this file have
            wide = np.full(len(times), np.nan)
            wide[begin:end] = numbers_of(values)
            columns.append(f"{name}{EVENT}{column}")
            cells.append(wide)
    first, *_ = parts.values()
    return Sheet(first.name, columns, cells, sum(sheet.left_out for sheet in parts.values()))


def _joined_times(sheets: list[Sheet]) -> tuple[str, Cells] | None:
    """The name and the cells of the times of all sheets, one after the other; None if a time cannot be read."""
    names = [sheet.columns[0] for sheet in sheets]
    stated = [stated_unit(name) for name in names]
    if len(set(stated)) == 1:
        return names[0], np.concatenate([sheet.cells[0] for sheet in sheets])
    units = [name if tick_ns(name) else "" for name in stated]
    try:
        times = [times_ns(sheet.cells[0], name) for sheet, name in zip(sheets, units)]
    except InputError:
        return None
    return "time (ns)", np.concatenate(times)


def without_stamps(text: str) -> str:
    """Convert the time stamps of a serial monitor, `12:30:05.250 -> `, to a first cell or a first label."""
    head = [line for line in text[:20_000].split("\n") if line.strip()]
    if not head or sum(bool(_STAMP.match(line)) for line in head) < 0.8 * len(head):
        return text
    first = _STAMP.sub("", head[0])
    separator = next((mark for mark in SEPARATORS if mark in first.strip()), ",")
    form = _STAMPED + ": {:.3f}; " if _PAIR.search(first) or _SEVERAL.search(first) else "{:.3f}" + separator

    def cell(stamp: re.Match[str]) -> str:
        ns, _ = moment_of(stamp[1]) or (0, False)
        return form.format(ns / 1e9)

    return "\n".join(_STAMP.sub(cell, line) for line in text.split("\n"))


def find_grid(lines: Sequence[str]) -> Grid | None:
    """Find the layout that fits most of these lines; None if hardly any line has numbers."""
    return _best_grid(lines, FEWEST_CELLS) or _best_grid(lines, 2)  # a time and one value: one row per axis


def _best_grid(lines: Sequence[str], fewest: int) -> Grid | None:
    """Return the grid with most rows, and of these with most numbers per row. fewest: numbers in a row."""
    best, best_rows, best_numbers = None, 0, 0
    for separator in SEPARATORS:
        candidate = _candidate(lines, separator, fewest)
        if candidate is None:
            continue
        rows, numbers, grid = candidate
        # Dates and zones contain blanks, so blanks need more rows to win
        wins = rows > best_rows or (rows == best_rows and separator != " " and numbers > best_numbers)
        if best is None or wins:
            best, best_rows, best_numbers = grid, rows, numbers
    if best is None or fewest == FEWEST_CELLS or (best.names is not None and best.width > 2):
        return best
    return None


def _candidate(lines: Sequence[str], separator: str, fewest: int) -> tuple[int, int, Grid] | None:
    """The number of rows, the numbers per row, and the grid for cells separated in this way; None if none fits."""
    split = [cells_in(line, separator) for line in lines]
    counts = [_numbers_in(cells) for cells in split]
    widths = Counter(len(cells) for cells, count in zip(split, counts) if count >= fewest)
    if not widths:
        return None
    width = max(widths, key=lambda width: (widths[width], width))
    row_counts = [count for cells, count in zip(split, counts) if count >= fewest and len(cells) == width]
    first = next(k for k, count in enumerate(counts) if count >= fewest)
    above = [k for k in range(first - 1, -1, -1) if lines[k].strip()]
    width, names = next(((w, k) for k in above[:3] for w in (width, *widths) if _has_names(lines[k], w)), (width, None))
    # Between the names and the first row, only a line of units is allowed
    if names is not None and names != above[0] and not _all_units(cells_in(lines[above[0]].lstrip(_MARKS), separator)):
        names = None
    if len(row_counts) < 2 and names is None:
        return None
    return len(row_counts), int(np.median(row_counts)), Grid(names, first, separator, width)


def _numbers_in(cells: list[str]) -> int:
    """The number of numbers and times. Empty cells count in a wide row that has nothing else."""
    count = sum(bool(_NUMBER.fullmatch(cell) or MOMENT.fullmatch(cell)) for cell in cells)
    empty = cells.count("")
    return len(cells) if len(cells) > 6 and count > 1 and count + empty == len(cells) else count


def _has_names(line: str, width: int) -> bool:
    """True if the line can be the names of `width` columns, perhaps separated in another way than the rows."""
    return any(_is_names(cells_in(line.lstrip(_MARKS), mark), width) for mark in SEPARATORS)


def _is_names(cells: list[str], width: int) -> bool:
    """True if most of the cells differ, and hardly any is a number or a unit."""
    filled_cells = [cell for cell in cells if cell]
    numbers = sum(bool(_NUMBER.fullmatch(cell)) or bool(re.search(r"[{}=]|:$", cell)) for cell in filled_cells)
    if len(set(filled_cells)) <= len(filled_cells) / 2 or (_all_units(cells) and len(filled_cells) > FEWEST_CELLS):
        return False
    return max(2, width - 3) <= len(filled_cells) <= width + 1 and numbers <= len(filled_cells) / 4


def _all_units(cells: list[str]) -> bool:
    filled_cells = [cell.strip("[]()") for cell in cells if cell]
    return len(filled_cells) > 2 and sum(unit(cell) in _UNITS for cell in filled_cells) > len(filled_cells) / 2


def _grid_below(lines: Sequence[str], wanted: Collection[str]) -> Grid | None:
    """The grid below a line that has all wanted names; None without such a line."""
    for k, line in enumerate(lines[:-1] if wanted else ()):
        for separator in dict.fromkeys((separator_of(line), *SEPARATORS)):
            cells = cells_in(_uncommented(line), separator)
            if set(wanted) <= set(cells):
                below = find_grid(lines[k + 1 :]) or Grid(None, 0, separator, 0)
                return Grid(k, k + 1 + below.first, below.separator, max(below.width, len(cells)))
    return None


def _uncommented(line: str) -> str:
    return line.lstrip(_MARKS) if line.lstrip()[:1] in ("#", "%", "/") else line


def _read(name: str, text: str, lines: Sequence[str], grid: Grid) -> Sheet:
    """The table of a grid."""
    columns = _names(lines, grid)
    body = text.split("\n", grid.first)[-1] if grid.first else text
    width = max(len(columns), grid.width)
    if grid.separator == " ":
        rows = map(str.split, body.split("\n"))
        cells, left_out = columns_of((row for row in rows if 0 < len(row) <= width), width), 0
    else:
        cells, left_out = columns_of_text(body, grid.separator, width, width)  # wider rows are left out
    used = [k for k, values in enumerate(cells) if columns[k] or np.any(filled(values))]
    head = "\n".join(lines[: grid.first])
    return Sheet(name, [columns[k] or f"#{k + 1}" for k in used], [cells[k] for k in used], left_out, head)


def _names(lines: Sequence[str], grid: Grid) -> list[str]:
    """The columns' names; "" for a column without a name. Units from a line below are added in brackets."""
    if grid.names is None:
        return [f"#{k + 1}" for k in range(grid.width)]
    line = _uncommented(lines[grid.names])
    parts = [cells_in(line, separator) for separator in dict.fromkeys((grid.separator, separator_of(line), " "))]
    names = next((part for part in parts if len(part) >= grid.width - 3), parts[0])
    names = [_WITH_UNIT.sub(r"\1 (\2)", name) for name in names]
    if grid.first > grid.names + 1:
        last = next(line for line in reversed(lines[: grid.first]) if line.strip())
        units = cells_in(last.lstrip("#%/ "), grid.separator)
        if _all_units(units) and len(units) <= len(names):
            units += [""] * (len(names) - len(units))
            names = [f"{name} ({mark.strip('[]()')})" if mark else name for name, mark in zip(names, units)]
    return [*names, *[""] * (grid.width - len(names))]


# One row per event


def _by_sensor(sheet: Sheet, names: Mapping[str, Sequence[str]]) -> Sheet:
    """If columns name the sensor, or the axis, of each row, give each sensor its own columns.

    names: the names of the columns of each sensor, if the lines above the rows give them.
    """
    places = [k for k in range(len(sheet.columns)) if _names_sensors(sheet, k, names)]
    if not places:
        return sheet
    words = [[str(cell).strip() for cell in sheet.cells[k].tolist()] for k in places]
    kinds = np.array([" ".join(row) for row in zip(*words)], dtype=object)
    rows_of = {kind: kinds == kind for kind in dict.fromkeys(kinds.tolist())}
    shared, own = [], []
    for k in (k for k in range(len(sheet.columns)) if k not in places):
        numbers = numbers_of(sheet.cells[k])
        varies = any(len(np.unique(numbers[rows])) > 1 for rows in rows_of.values())
        valid = np.any(np.isfinite(numbers.astype(float))) and varies
        (own if valid and not _is_time(sheet, k, rows_of.values()) else shared).append(k)
    columns, cells = [sheet.columns[k] for k in shared], [sheet.cells[k] for k in shared]
    titles_of = {kind: names.get(kind.split(" ")[0], ()) for kind in rows_of}
    for (kind, titles), rows in zip(titles_of.items(), rows_of.values()):
        for k in own:
            values = numbers_of(sheet.cells[k]).astype(float)
            if np.any(np.isfinite(values[rows])):
                title = titles[k - 1] if 0 < k <= len(titles) else sheet.columns[k]
                columns.append(kind if len(own) == 1 else f"{kind}{EVENT}{title}")
                cells.append(np.where(rows, values, np.nan))
    if shared:
        columns[0] = next((titles[0] for titles in titles_of.values() if titles), columns[0])
    clock = next((k for k, name in enumerate(columns[: len(shared)]) if TIME_NAME.search(plain(name))), None)
    if clock is not None:  # one sensor after the other
        order = np.argsort(times_ns(cells[clock]), kind="stable")
        cells = cells if np.all(np.diff(order) > -MOST_KINDS) else [values[order] for values in cells]
    return Sheet(sheet.name, columns, cells, sheet.left_out, sheet.head)


def _names_sensors(sheet: Sheet, place: int, names: Mapping[str, Sequence[str]]) -> bool:
    """True if a column names the sensor of each row: its cells change repeatedly between a few texts, or between a few
    numbers if the column's name is suitable."""
    name, values = sheet.columns[place], sheet.cells[place]
    if names and not place:
        return any(str(cell) in names for cell in values[:100].tolist())
    instances = any(titles[place - 1 : place] == ["I"] for titles in names.values())
    if values.dtype.kind == "f" or (values.dtype.kind != "O" and not (_SENSOR_ID.search(name.lower()) or instances)):
        return False
    texts = [str(cell).strip() for cell in values.tolist()]
    counts = Counter(texts)
    named = values.dtype.kind != "O" or all(re.match(r"[A-Za-z]", kind) for kind in counts)
    changes = sum(a != b for a, b in itertools.pairwise(texts))
    blocks = changes == len(counts) - 1 and bool(_SENSOR_ID.search(name.lower())) and len(texts) > 20 * len(counts)
    return 2 <= len(counts) <= MOST_KINDS and named and (changes > 0.01 * len(texts) + 2 or blocks)


def _is_time(sheet: Sheet, place: int, rows_of_sensors: Iterable[Bools]) -> bool:
    """True if a column increases, or has a time's name and increases in each sensor's rows."""
    numbers = numbers_of(sheet.cells[place])
    named = bool(TIME_NAME.search(plain(sheet.columns[place])))
    return increases(numbers) or (named and all(increases(numbers[rows]) for rows in rows_of_sensors))


# Labels before the values


def _labelled(name: str, text: str) -> Sheet | None:
    """Read a table from lines of `label: value`. None without such lines."""
    head = [line for line in text[:20_000].split("\n") if line.strip()]
    pairs = [len(list(_labelled_values(line))) for line in head]
    if sum(count > 0 for count in pairs) < 0.7 * len(head) or sum(pairs) < max(FEWEST_CELLS, 1.5 * len(head)):
        return None
    rows: list[dict[str, str]] = []
    row: dict[str, str] = {}
    stamp = ""
    for line in text.split("\n"):
        for label, value in sorted(_labelled_values(line), key=lambda pair: pair[0] != _STAMPED):
            if label in row and label != _STAMPED:  # a label that returns begins a new sample
                rows.append(row)
                row = {_STAMPED: stamp} if stamp else {}
            if label == _STAMPED:
                stamp = value
            row.setdefault(label, value)
    rows.append(row)
    counts = Counter(label for row in rows for label in row)
    labels = [label for label, count in counts.items() if count > len(rows) / 2]
    if len(labels) < FEWEST_CELLS:
        return None
    cells = columns_of(([row.get(label, "") for label in labels] for row in rows), len(labels))
    return Sheet(name, labels, cells)


def _labelled_values(line: str) -> Iterator[tuple[str, str]]:
    """Yield (label, value) for each value in a line such as "Acceleration X: 0.1 g, Y: 0.2". The word is added to a
    label of one letter, and the unit in brackets."""
    for several in _SEVERAL.finditer(line):
        values = re.split(r"[\s,;]+", several[2])
        for axis, value in zip("xyz" if len(values) == 3 else map(str, range(1, 10)), values):
            yield f"{several[1]} {axis}", value
    prefix, pairs = "", list(_PAIR.finditer(_SEVERAL.sub("", line)))
    stated = next((pair["unit"] for pair in reversed(pairs) if pair["unit"] and unit(pair["unit"]) in _UNITS), "")
    for pair in pairs:
        label = re.sub(r"\s+", " ", pair["label"].strip(" ,;|-"))
        words = label.split()
        if len(words) > 1 and len(words[-1]) == 1:
            prefix = " ".join(words[:-1])
        elif len(label) == 1 and prefix:
            label = f"{prefix} {label}"
        label_unit = pair["unit"] if pair["unit"] and unit(pair["unit"]) in _UNITS else stated
        yield (f"{label} ({label_unit})" if label_unit and label[-1:].lower() in "xyz" else label), pair["value"]
