"""Converts the text of a file to plain CSV: JSON becomes rows, and numbers get - as their minus and a decimal point.

Spreadsheets and apps write numbers as their user's country does: -1,029.5 may be -1.029,5 or U+2212 and digits.
"""

import contextlib
import csv
import io
import json
import re
from collections.abc import Iterator
from typing import Any

FEWEST_ROWS = 20  # JSON with fewer rows is something else, such as a calibration
LOOKED_AT = 400  # lines used to find the decimal mark
_MINUS = re.compile("[\u2010-\u2013\u2212\ufe63\uff0d](?=[0-9.,])")
_BLANK = re.compile("(?<=[0-9])[\u00a0\u2009\u202f'](?=[0-9]{3})")  # separates thousands
_BETWEEN = re.compile(r'[;\t\s"]+')
_CELL = r'(?<![^;\t\s"])[+-]?\d{1,3}(?:%s\d{3})+(?:%s\d+)?(?![^;\t\s"])'  # a number with separators of thousands
_POINTS, _COMMAS = re.compile(_CELL % (r"\.", ",")), re.compile(_CELL % (",", r"\."))
_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")


def plain_text(text: str) -> str:
    """The text as CSV with plain numbers."""
    if text.lstrip()[:1] in ("[", "{"):
        text = _rows_of_json(text)
    if not text.isascii() or "'" in text:
        text = _BLANK.sub("", _MINUS.sub("-", text))
    votes = [_decimal_comma(line) for line in text.split("\n", LOOKED_AT)[:LOOKED_AT]]
    if votes.count(False) > len(votes) / 2:
        return text
    if any("." in cell[0] for cell in _COMMAS.finditer(text)):  # 1,029.5
        return _COMMAS.sub(lambda cell: cell[0].replace(",", ""), text)
    if votes.count(True) <= votes.count(False):
        return text
    if any("," in cell[0] for cell in _POINTS.finditer(text)):  # 1.029,5
        text = _POINTS.sub(lambda cell: cell[0].replace(".", ""), text)
    return re.sub(r"(?<=\d),(?=\d)", ".", text)


def _decimal_comma(line: str) -> bool | None:
    """True if the line has numbers with a decimal comma. False if commas separate its cells. None without commas."""
    cells = [cell for cell in _BETWEEN.split(line) if cell.strip(",")]
    if any(cell.endswith(",") or cell.startswith(",") for cell in cells):
        return False
    if any(cell.count(",") > 1 and (len(cells) == 1 or not _COMMAS.fullmatch(cell)) for cell in cells):
        return False
    return True if len(cells) > 1 and any(map(_COMMA_NUMBER.fullmatch, cells)) else None


def _rows_of_json(text: str) -> str:
    """Convert JSON to CSV: an array of objects, an object of arrays, or one object per line. Nested names are joined by
    a point. Another text is unchanged."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = list(_objects(text))
    if isinstance(found, dict):
        lists = {name: values for name, values in found.items() if isinstance(values, list)}
        found = [row | {"sensor": name} for name, rows in lists.items() for row in rows if isinstance(row, dict)]
        found = found or [dict(zip(lists, row)) for row in zip(*lists.values())]
        with contextlib.suppress(TypeError):
            found.sort(key=lambda row: next(iter(row.values())))  # by time
    rows = [dict(_flat(row)) for row in found if isinstance(row, dict)]
    if len(rows) < FEWEST_ROWS:
        return text
    table = io.StringIO()
    writer = csv.DictWriter(table, list(dict.fromkeys(name for row in rows for name in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return table.getvalue()


def _objects(text: str) -> Iterator[Any]:
    for line in text.split("\n"):
        try:
            yield json.loads(line.strip().rstrip(","))
        except (ValueError, RecursionError):
            continue


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, list):
        value = dict(zip("xyz" if len(value) == 3 else map(str, range(len(value))), value))
    if not isinstance(value, dict):
        yield name, value
        return
    for key, inner in value.items():
        yield from _flat(inner, f"{name}.{key}" if name else key)
