"""Reads the files of a recording as plain CSV: one file, a folder or a zip, in any encoding that apps use.

Spreadsheets and apps write numbers as their user's country does: -1,029.5 may be -1.029,5 or U+2212 and digits. JSON
becomes rows.
"""

import contextlib
import csv
import gzip
import io
import itertools
import json
import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any

from ..common.messages import InputError, printable
from ..logs.csv_text import LONGEST_LINE
from ..logs.source import SUFFIXES, errors_of, open_input

_EXCEL = b"\xd0\xcf\x11\xe0"  # first bytes of older Excel files; newer Excel files are zips
# Largest recording as text: some hours at 100 Hz. Reading takes at most ten times this memory.
MOST_BYTES = 250_000_000
MOST_FILES = 10_000  # largest number of files in a folder or a zip
_ENTRY_BYTES = 400  # generous size of a file's entry in the directory of a zip: 46 bytes, its path and extra fields
_LONGEST_END = 22 + 65_535  # bytes of the last record of a zip and of the longest comment behind it
MOST_IN_LINE = 10 * LONGEST_LINE  # characters in a line; longer lines than LONGEST_LINE are damaged rows
# Suffixes of tables that are read if there are no others
_RARE = (".json", ".jsonl", ".ndjson", ".gcsv", ".log", ".dat", ".asc", "")
_CHINESE = re.compile(b"(?:[\xb0-\xf7][\xa1-\xfe]){2}")  # two Chinese characters in gb18030
FEWEST_ROWS = 20  # JSON with fewer rows is something else, such as a calibration
LOOKED_AT = 400  # lines used to find the decimal mark
_MINUS = re.compile("[\u2010-\u2015\u2212\ufe58\ufe63\uff0d\u00ad](?=[0-9.,])")
_BLANK = re.compile("(?<=[0-9])[\u00a0\u2009\u202f'\u2019](?=[0-9]{3})")  # separates thousands
_QUOTES = str.maketrans(dict.fromkeys("'\u2018\u2019\u201c\u201d\u201e", '"'))
# A negative number with a blank after its minus, or in brackets, as accountants write it
_APART, _IN_BRACKETS = (re.compile(r'(?<=[,;\t"\n])( *)' + number) for number in (r"- +(?=[\d.])", r"\((\d[\d.,]*)\)"))
# A unit behind a number
_UNIT = re.compile(r'(?<=\d) ?(?:m/s(?:\^?2|²)|(?:°|deg|rad)/s|dps|mg|g|m?s)(?=[,;\t"]|$)', re.MULTILINE)
_BETWEEN = re.compile(r'[;\t\s"]+')
_CELL = r'(?<![^;\t\s"])[+-]?\d{1,3}(?:%s\d{3})+(?:%s\d+)?(?![^;\t\s"])'  # a number with separators of thousands
_POINTS, _COMMAS = re.compile(_CELL % (r"\.", ",")), re.compile(_CELL % (",", r"\."))
_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass
class RecordingFile:
    """One file of a recording."""

    name: str  # its path below the given folder or zip, with "/"
    content: bytes  # its unpacked bytes
    text: str  # the decoded content; lines end in a line feed

    @property
    def folder(self) -> str:
        """The folder part of the name, or ""."""
        return str(PurePosixPath(self.name).parent).removeprefix(".")

    @property
    def stem(self) -> str:
        """The name without folders and suffix, in lower case."""
        return PurePosixPath(self.name.removesuffix(".gz")).stem.lower()

    def first_lines(self, count: int) -> list[str]:
        """Return the first `count` lines of the text that are not blank, or fewer."""
        return [line for line in self.text[: 1 << 16].split("\n") if line.strip()][:count]


def read_files(source: Path | str) -> list[RecordingFile]:
    """Read a file, a folder or a zip. In a folder or a zip, only tables are read, or a zip if it is the only content.

    Raises InputError for a source that is missing, damaged, empty, not text, or over MOST_BYTES when unpacked.
    """
    path = Path(source)
    with errors_of(str(path)):
        files = [_recording_file(name, content) for name, content in _bounded(path)]
        files = [file for file in files if file is not None] or _no_text(path)
    files = [file for file in files if file.text.strip() or file.name.endswith(".parquet")]
    if not files:
        raise InputError(f"{path} contains no recording: give the file, the folder or the zip that an app has exported")
    return files


def _bounded(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield _contents(). Raises InputError if the contents are too large."""
    size = 0
    for name, content in _contents(path):
        size += len(content)
        if size > MOST_BYTES:
            raise InputError(f"{path} is too large: over {MOST_BYTES / 1e6:.0f} MB when unpacked: give a part of it")
        yield name, content


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the name and the content of each file of a recording in a file, a zip or a folder. Raises InputError."""
    if not path.is_dir():
        with open_input(path) as file:
            zipped = file.read(4) == b"PK\x03\x04" or path.suffix.lower() == ".zip"
        yield from _unzipped(path) if zipped else [(path.name, _unpacked_file(path))]
        return
    resolved = path.resolve()
    # skip links that lead out of the folder
    names = (file for file in path.rglob("*") if file.is_file() and file.resolve().is_relative_to(resolved))
    names = sorted(itertools.islice(names, MOST_FILES + 1))
    if len(names) > MOST_FILES:
        raise InputError(f"{path} holds over {MOST_FILES} files: give the folder of one recording")
    tables = _tables(names, lambda file: file.relative_to(path).as_posix())
    zips = [file for file in names if file.suffix.lower() == ".zip"]
    if not tables and len(zips) > 1:
        raise InputError(f"{path} holds {len(zips)} zip files: give one of them, such as {zips[0]}")
    if not tables and zips:
        yield from _unzipped(zips[0])
    for file in tables:
        yield file.relative_to(path).as_posix(), _unpacked_file(file)


def _unpacked_file(path: Path) -> bytes:
    with open_input(path) as file:
        return _unpacked(path.name, file)


def _unpacked(name: str, file: IO[bytes]) -> bytes:
    """The content of a file, cut one byte after the limit, which shows that the file is too large."""
    with gzip.GzipFile(fileobj=file) if name.endswith(".gz") else contextlib.nullcontext(file) as plain:
        return plain.read(MOST_BYTES + 1)


def _check_directory(file: IO[bytes], path: Path) -> None:
    """Refuse a zip whose directory has more bytes than MOST_FILES files need, because zipfile reads it whole."""
    size = file.seek(0, 2)
    file.seek(max(0, size - _LONGEST_END))
    _, mark, last = file.read().rpartition(b"PK\5\6")
    # The directory's size is in bytes 8 to 11 behind the mark
    if mark and len(last) >= 12 and struct.unpack_from("<I", last, 8)[0] > _ENTRY_BYTES * MOST_FILES:
        raise InputError(f"{path} holds over {MOST_FILES} files: give the zip of one recording")
    file.seek(0)


def _unzipped(path: Path) -> Iterator[tuple[str, bytes]]:
    with open_input(path) as file:
        _check_directory(file, path)
        with zipfile.ZipFile(file) as archive:
            if "[Content_Types].xml" in archive.namelist():
                raise InputError(f"{path}: a table of Excel: export it as CSV")
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            for entry in _tables(entries, lambda entry: entry.filename):
                yield printable(entry.filename.replace("\\", "/")), _unpacked_entry(archive, entry, path)


def _unpacked_entry(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path) -> bytes:
    try:
        # bzip2 and LZMA would be unpacked whole, even if only a part is read
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise NotImplementedError
        with archive.open(entry) as file:
            return _unpacked(entry.filename, file)
    except RuntimeError as error:  # includes NotImplementedError
        raise InputError(f"{path} is packed with a password, or in another way: unpack it first") from error
    except (OSError, ValueError) as error:  # an entry that points outside the file
        raise zipfile.BadZipFile(str(error)) from error


def _tables(files: list[Any], name_of: Callable[[Any], str]) -> list[Any]:
    """The files with the name of a table, neither hidden nor a companion file of macOS."""
    paths = [(file, PurePosixPath(name_of(file).lower().removesuffix(".gz"))) for file in files]
    paths = [(file, path) for file, path in paths if not any(part.startswith((".", "__macosx")) for part in path.parts)]
    paths = [(file, path) for file, path in paths if not path.name.startswith(("readme", "license", "licence"))]
    usual = [file for file, path in paths if path.suffix in SUFFIXES]
    return usual or [file for file, path in paths if path.suffix in _RARE and not path.name.endswith(".cal.json")]


def _no_text(path: Path) -> list[RecordingFile]:
    if path.is_file():
        with open_input(path) as file:
            excel = "a table of Excel: export it as CSV" if file.read(4) == _EXCEL else ""
        raise InputError(f"{path}: {excel or 'not text: give what an app has exported as CSV or VBO'}")
    return []


def _recording_file(name: str, content: bytes) -> RecordingFile | None:
    """The RecordingFile of these bytes; None if they are not text."""
    if content.startswith(b"PAR1"):
        return RecordingFile(name, content, "")
    text = _decoded(content)
    if sum(character < " " and character not in "\t\r\n" for character in text[:4000]) > 3:
        return None
    text = plain_text(text.replace("\r\n", "\n").replace("\r", "\n"))
    first_lines = text[: 64 * MOST_IN_LINE].split("\n", 64)[:64]
    if any(len(line) > MOST_IN_LINE for line in first_lines):
        raise InputError(f"{name}: a line of over {MOST_IN_LINE:,} characters: it is no table of a recording")
    return RecordingFile(name, content, text)


def _decoded(content: bytes) -> str:
    encoding = next((encoding for bom, encoding in _BOMS if content.startswith(bom)), "")
    sample = content[:1000]
    if not encoding and sample.count(0) > len(sample) // 4:  # UTF-16 without a byte order mark: every other byte is 0
        encoding = "utf-16-le" if sample[1::2].count(0) > sample[::2].count(0) else "utf-16-be"
    # Windows may write a degree sign in cp1252, and Chinese in gb18030
    for name in (encoding or "utf-8", *(["gb18030"] if _CHINESE.search(content) else [])):
        with contextlib.suppress(UnicodeDecodeError):
            return content.decode(name)
    return content.decode("cp1252", errors="replace")


# Numbers and JSON


def plain_text(text: str) -> str:
    """The text as CSV with plain numbers."""
    if text.lstrip()[:1] in ("[", "{"):
        text = _rows_of_json(text)
    if not text.isascii() or "'" in text:
        text = _BLANK.sub("", _MINUS.sub("-", text))
        text = text.translate(_QUOTES) if text.lstrip()[:1] in "'\u2018\u201c\u201e" else text
    head = text.split("\n", LOOKED_AT)[:LOOKED_AT]
    if sum(line.count("|") > 2 for line in head) > len(head) / 2:  # | between the cells
        text = "\n".join(line.strip(" |").replace("|", "\t") for line in text.split("\n"))
    # - 1.5 or (1.5) for -1.5
    if any(_APART.search(f"\n{line}") or _IN_BRACKETS.search(f"\n{line}") for line in head[1:]):
        text = _IN_BRACKETS.sub(r"-\2", _APART.sub("-", text))
    if sum(len(_UNIT.findall(line)) > 5 for line in head) > len(head) / 2:  # a unit behind each number
        text = _UNIT.sub("", text)
    votes = [_decimal_comma(line) for line in text.split("\n", LOOKED_AT)[:LOOKED_AT]]
    if votes.count(False) > len(votes) / 2:
        return text  # commas separate the cells
    if any("." in cell[0] for cell in _COMMAS.finditer(text)):  # 1,029.5
        return _COMMAS.sub(lambda cell: cell[0].replace(",", ""), text)
    if votes.count(True) <= votes.count(False):
        return text
    if any("," in cell[0] for cell in _POINTS.finditer(text)):  # 1.029,5
        text = _POINTS.sub(lambda cell: cell[0].replace(".", ""), text)
    return re.sub(r"(?<=\d),(?=\d)", ".", text)


def _decimal_comma(line: str) -> bool | None:
    """True if the line has numbers with a decimal comma, False if commas separate its cells, None without commas."""
    cells = [cell for cell in _BETWEEN.split(line) if cell.strip(",")]
    if any(cell.endswith(",") or cell.startswith(",") for cell in cells):
        return False
    if any(cell.count(",") > 1 and (len(cells) == 1 or not _COMMAS.fullmatch(cell)) for cell in cells):
        return False
    return True if len(cells) > 1 and any(map(_COMMA_NUMBER.fullmatch, cells)) else None


def _rows_of_json(text: str) -> str:
    """Convert JSON to CSV. Another text is unchanged.

    The rows may be objects, lists, or numbers of a list per column, also inside other objects, in one value or one per
    line. Nested names are joined by a point. Rows of several sensors get the name of their sensor, and are sorted by
    their first value, the time.
    """
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        values = list(_objects(text))
    tables = [(name, rows) for name, rows in _json_tables(values) if len(rows) >= FEWEST_ROWS]
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


def _json_tables(value: Any, name: str = "") -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Yield (name, rows) for each table in a value of JSON."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        named = all(isinstance(cell, str) for cell in value[0])
        names = value[0] if named else [f"#{k + 1}" for k in range(len(value[0]))]
        yield name, [dict(zip(names, row)) for row in value[named:] if isinstance(row, list)]
    elif isinstance(value, list):
        yield name, [dict(_flat(row)) for row in value if isinstance(row, dict)]
    elif isinstance(value, dict):
        columns = dict(_json_columns(value))
        if isinstance(value.get("columns"), list) and isinstance(value.get("data"), list):  # pandas
            yield from _json_tables([value["columns"], *value["data"]], name)
        elif len(columns) > 1 and len({len(cells) for cells in columns.values()}) == 1:
            yield name, [dict(_flat(dict(zip(columns, row)))) for row in zip(*columns.values())]
        else:
            for key, inner in value.items():
                yield from _json_tables(inner, key)


def _json_columns(value: dict[str, Any], name: str = "") -> Iterator[tuple[str, list[Any]]]:
    """Yield (name, cells) for each column, whose cells are a list, or an object with a number per row."""
    for key, inner in value.items():
        joined = f"{name}.{key}" if name else key
        if isinstance(inner, dict) and len(inner) >= FEWEST_ROWS:
            inner = list(inner.values())
        if isinstance(inner, dict):
            yield from _json_columns(inner, joined)
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
