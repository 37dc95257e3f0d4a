"""The text files of a recording: one file, a folder of them, or a zip, in whatever encoding the app has written."""

import gzip
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ..errors import InputError, cause

_EXCEL = b"\xd0\xcf\x11\xe0"  # its older files begin so; the newer are zips
SUFFIXES = (".csv", ".txt", ".tsv", ".vbo", ".parquet")  # what is looked at in a folder or a zip
_BOMS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass
class Piece:
    """One file of a recording. name: with its folders below what was given, parted by /. content: its bytes, unpacked.

    text: the same decoded; lines end in a line feed.
    """

    name: str
    content: bytes
    text: str

    @property
    def folder(self) -> str:
        """The folders of its name, "" for none."""
        return str(PurePosixPath(self.name).parent).removeprefix(".")

    @property
    def stem(self) -> str:
        """The name without folders and suffix, in small letters."""
        return PurePosixPath(self.name.removesuffix(".gz")).stem.lower()

    def first_lines(self, count: int) -> list[str]:
        """At most count lines of the text, without those that are blank."""
        return [line for line in self.text[: 1 << 16].split("\n") if line.strip()][:count]


def read_pieces(source: Path | str) -> list[Piece]:
    """What a file, a folder or a zip holds; in the last two only files of SUFFIXES, and one zip that is all they hold.

    Raises InputError for what is not there, is damaged, empty, or no text.
    """
    path = Path(source)
    try:
        pieces = [_piece(name, content) for name, content in _contents(path)]
        pieces = [piece for piece in pieces if piece is not None] or _no_text(path)
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file") from error
    except gzip.BadGzipFile as error:
        raise InputError(f"{path} is not a gzip file: unpacked recordings have names without .gz") from error
    except (zipfile.BadZipFile, NotImplementedError, zlib.error, EOFError) as error:
        raise InputError(f"{path} is damaged or cut short: copy it again") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error
    pieces = [piece for piece in pieces if piece.text.strip() or piece.name.endswith(".parquet")]
    if not pieces:
        raise InputError(f"{path} holds no recording: give the file, the folder or the zip that an app has exported")
    return pieces


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
    if not path.is_dir():
        content = path.read_bytes()
        if content.startswith(b"PK\x03\x04") or path.suffix.lower() == ".zip":
            yield from _unzipped(path)
        else:
            yield path.name, gzip.decompress(content) if path.suffix == ".gz" else content
        return
    names = sorted(file for file in path.rglob("*") if file.is_file())
    inside = [file for file in names if _wanted(file.relative_to(path).as_posix())]
    packed = [file for file in names if file.suffix.lower() == ".zip"]
    if not inside and len(packed) > 1:
        raise InputError(f"{path} holds {len(packed)} zip files: give one of them, such as {packed[0]}")
    if not inside and packed:
        yield from _unzipped(packed[0])
    for file in inside:
        content = file.read_bytes()
        yield file.relative_to(path).as_posix(), gzip.decompress(content) if file.suffix == ".gz" else content


def _unzipped(path: Path) -> Iterator[tuple[str, bytes]]:
    with zipfile.ZipFile(path) as archive:
        if "[Content_Types].xml" in archive.namelist():
            raise InputError(f"{path}: a table of Excel: export it as CSV")
        for entry in archive.infolist():
            if not entry.is_dir() and _wanted(entry.filename):
                yield entry.filename.replace("\\", "/"), _unpacked(archive, entry)


def _unpacked(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    try:
        return archive.read(entry)
    except RuntimeError as error:  # NotImplementedError is one, too
        raise InputError(f"{archive.filename} is packed with a password, or in another way: unpack it first") from error
    except (OSError, ValueError) as error:  # an entry that points outside the file
        raise zipfile.BadZipFile(str(error)) from error


def _wanted(name: str) -> bool:
    """A table by its name; neither hidden nor one of macOS's companions."""
    path = PurePosixPath(name)
    hidden = any(part.startswith((".", "__MACOSX")) for part in path.parts)
    return not hidden and name.lower().removesuffix(".gz").endswith(SUFFIXES)


def _no_text(path: Path) -> list[Piece]:
    if path.is_file():
        excel = "a table of Excel: export it as CSV" if path.read_bytes()[:4] == _EXCEL else ""
        raise InputError(f"{path}: {excel or 'not text: give what an app has exported as CSV or VBO'}")
    return []


def _piece(name: str, content: bytes) -> Piece | None:
    """None for what is no text."""
    if content.startswith(b"PAR1"):
        return Piece(name, content, "")
    text = _decoded(content)
    if sum(character < " " and character not in "\t\r\n" for character in text[:4000]) > 3:
        return None
    return Piece(name, content, text.replace("\r\n", "\n").replace("\r", "\n"))


def _decoded(content: bytes) -> str:
    encoding = next((encoding for bom, encoding in _BOMS if content.startswith(bom)), "")
    sample = content[:1000]
    if not encoding and sample.count(0) > len(sample) // 4:  # UTF-16 without its mark: every other byte is 0
        encoding = "utf-16-le" if sample[1::2].count(0) > sample[::2].count(0) else "utf-16-be"
    try:
        return content.decode(encoding or "utf-8")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")  # a degree sign of Windows
