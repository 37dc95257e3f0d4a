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
_MINUS = re.compile("[\u2010-\u2015\u2212\ufe58\ufe63\uff0d\u00ad](?=[0-9.,])")
_BLANK = re.compile("(?<=[0-9])[\u00a0\u2009\u202f'\u2019](?=[0-9]{3})")  # separates thousands
_QUOTES = str.maketrans(dict.fromkeys("'\u2018\u2019\u201c\u201d\u201e", '"'))
# A negative number with a blank after its minus, or in brackets, as accountants write it
_APART, _IN_BRACKETS = (re.compile(r'(?<=[,;\t"\n])( *)' + number) for number in (r"- +(?=[\d.])", r"\((\d[\d.,]*)\)"))
_UNIT = re.compile(
    r'(?<=\d) ?(?:m/s(?:\^?2|²)|(?:°|deg|rad)/s|dps|mg|g|m?s)(?=[,;\t"]|$)', re.MULTILINE
)  # behind a number
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
        text = text.translate(_QUOTES) if text.lstrip()[:1] in "'\u2018\u201c\u201e" else text
    head = text.split("\n", LOOKED_AT)[:LOOKED_AT]
    if sum(line.count("|") > 2 for line in head) > len(head) / 2:
        text = "\n".join(line.strip(" |").replace("|", "\t") for line in text.split("\n"))
    if any(_APART.search(f"\n{line}") or _IN_BRACKETS.search(f"\n{line}") for line in head[1:]):
        text = _IN_BRACKETS.sub(r"-\2", _APART.sub("-", text))
    if sum(len(_UNIT.findall(line)) > 5 for line in head) > len(head) / 2:
        text = _UNIT.sub("", text)
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
    """Convert JSON to CSV. Another text is unchanged.

    The rows may be objects, lists, or numbers of a list per column, in one value or one per line. They may be inside
    other objects. Nested names are joined by a point. Rows of several sensors get the name of their sensor, and are
    sorted by their first value, the time."""
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        values = list(_objects(text))
    tables = [(name, rows) for name, rows in _tables(values) if len(rows) >= FEWEST_ROWS]
    rows = [row | ({"sensor": name} if len(tables) > 1 else {}) for name, rows in tables for row in rows]
    if not rows:
        return text
    if len(tables) > 1:
        with contextlib.suppress(TypeError):
            rows.sort(key=lambda row: next(iter(row.values())))
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


def _tables(value: Any, name: str = "") -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Yield (name, rows) for each table in a value of JSON."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        named = all(isinstance(cell, str) for cell in value[0])
        names = value[0] if named else [f"#{k + 1}" for k in range(len(value[0]))]
        yield name, [dict(zip(names, row)) for row in value[named:] if isinstance(row, list)]
    elif isinstance(value, list):
        yield name, [dict(_flat(row)) for row in value if isinstance(row, dict)]
    elif isinstance(value, dict):
        columns = dict(_columns(value))
        if isinstance(value.get("columns"), list) and isinstance(value.get("data"), list):  # pandas
            yield from _tables([value["columns"], *value["data"]], name)
        elif len(columns) > 1 and len({len(cells) for cells in columns.values()}) == 1:
            yield name, [dict(_flat(dict(zip(columns, row)))) for row in zip(*columns.values())]
        else:
            for key, inner in value.items():
                yield from _tables(inner, key)


def _columns(value: dict[str, Any], name: str = "") -> Iterator[tuple[str, list[Any]]]:
    """Yield (name, cells) for each column in an object, whose cells are a list, or an object with a number per row."""
    for key, inner in value.items():
        joined = f"{name}.{key}" if name else key
        if isinstance(inner, dict) and len(inner) >= FEWEST_ROWS:
            inner = list(inner.values())
        if isinstance(inner, dict):
            yield from _columns(inner, joined)
        elif isinstance(inner, list) and inner and not isinstance(inner[0], dict):
            yield joined, inner


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, list):
        value = dict(zip("xyz" if len(value) == 3 else map(str, range(len(value))), value))
    if not isinstance(value, dict):
        yield name, value
        return
    for key, inner in value.items():
        yield from _flat(inner, f"{name}.{key}" if name else key)
