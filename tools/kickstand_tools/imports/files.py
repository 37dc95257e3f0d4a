"""Reads the text files of a recording: one file, a folder or a zip, in any encoding that apps use."""

import contextlib
import gzip
import itertools
import re
import struct
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any

from ..common.errors import InputError, printable
from ..logs.source import SUFFIXES, errors_of, open_input
from .texts import plain_text

_EXCEL = b"\xd0\xcf\x11\xe0"  # first bytes of older Excel files; newer Excel files are zips
# Largest recording as text: some hours at 100 Hz. Reading takes at most ten times this memory.
MOST_BYTES = 250_000_000
MOST_FILES = 10_000  # largest number of files in a folder or a zip
LONGEST_LINE = 1_000_000  # characters in the longest line, ten times as many as a thousand columns need
_RARE = (
    ".json",
    ".jsonl",
    ".ndjson",
    ".gcsv",
    ".log",
    ".dat",
    ".asc",
    "",
)  # suffixes of tables that are read if there are no others
_CHINESE = re.compile(b"(?:[\xb0-\xf7][\xa1-\xfe]){2}")  # two Chinese characters in gb18030
_BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass
class RecordingFile:
    """One file of a recording.

    name: its path below the given folder or zip, with "/".
    content: its unpacked bytes.
    text: the decoded content; lines end in a line feed.
    """

    name: str
    content: bytes
    text: str

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
    """Read a file, a folder or a zip. In a folder or a zip, only files of SUFFIXES are read, or a zip if it is the only
    content.

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


def _read(file: IO[bytes]) -> bytes:
    """The content of a file, cut one byte after the limit. The extra byte shows that the file is too large."""
    return file.read(MOST_BYTES + 1)


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
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
        return _without_gzip(path.name, file)


def _without_gzip(name: str, file: IO[bytes]) -> bytes:
    if not name.endswith(".gz"):
        return _read(file)
    with gzip.GzipFile(fileobj=file) as unpacked:
        return _read(unpacked)  # type: ignore[arg-type] - it has read()


def _check_directory(file: IO[bytes], path: Path) -> None:
    """Refuse a zip whose directory lists over MOST_FILES files, because zipfile reads the whole directory."""
    size = file.seek(0, 2)
    file.seek(max(0, size - 65_557))
    _, mark, last = file.read().rpartition(b"PK\5\6")
    if mark and len(last) >= 12 and struct.unpack_from("<I", last, 8)[0] > 400 * MOST_FILES:
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
                yield printable(entry.filename.replace("\\", "/")), _unpacked(archive, entry, path)


def _unpacked(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path) -> bytes:
    try:
        # bzip2 and LZMA would be unpacked whole, even if only a part is read
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise NotImplementedError
        with archive.open(entry) as file:
            return _without_gzip(entry.filename, file)
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
    if max(map(len, text[: 64 * LONGEST_LINE].split("\n", 64)[:64])) > LONGEST_LINE:
        raise InputError(f"{name}: a line of over {LONGEST_LINE:,} characters: it is no table of a recording")
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
