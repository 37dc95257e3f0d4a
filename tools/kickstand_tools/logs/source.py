"""Reads the text of a log: from a path, gzipped if its name ends in .gz, or from an open file of text or bytes."""

import contextlib
import gzip
import os
import stat
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import IO, Any, cast

from ..common.messages import InputError, Message, Remedy, cause, kind

# Most bytes without a line end. A file system may leave NUL bytes at the end of a file after a power cut
MOST_PENDING = 16_000_000
SUFFIXES = (".csv", ".txt", ".tsv", ".vbo", ".parquet")  # suffixes of logs and of other apps' tables
File = Path | str | IO[bytes] | IO[str]
Progress = Callable[[int, int], None]  # called with (done, total) in the same unit; total is 0 if unknown

NulEnd = kind("nul-end", "count", "its end is {count} NUL bytes, as after a loss of power: they are left out")
CutGzip = kind(
    "cut-gzip",
    text="the file was cut: the readings at its end are lost",
    todo=Remedy("copy it again if you can"),
)


def open_input(path: Path | str) -> IO[bytes]:
    """Open an ordinary file for reading.

    Raises InputError for a directory, and for a device or a pipe, because it may never end.
    """
    try:
        # O_NONBLOCK: opening a pipe must not wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        if stat.S_ISREG(os.fstat(descriptor).st_mode):
            return os.fdopen(descriptor, "rb")
        os.close(descriptor)
        raise InputError(f"{path} is not an ordinary file: give a file's name, or copy what a pipe gives into a file")
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error


def name_of(source: object) -> str:
    """Return the name of a source for messages: its path, the name of the file or of the log, or "the log"."""
    if isinstance(source, (Path, str)):
        return str(source)
    name = getattr(source, "name", None)
    return name if isinstance(name, str) and name else "the log"


def log_stem(name: str) -> str:
    """Return the name of a log, or of an export, without path and suffixes."""
    name = Path(os.path.abspath(name)).name.removesuffix(".gz")  # abspath gives the folder's name for "."
    ending = next((suffix for suffix in (*SUFFIXES, ".zip") if name.lower().endswith(suffix)), "")
    return name[: len(name) - len(ending)]


def chunks(source: File, size: int, remarks: list[Message] | None = None) -> Generator[tuple[bytes, int], None, None]:
    """Yield the unpacked text in chunks of whole lines, and the bytes of the file read so far.

    Line ends are converted to line feeds. The last line may have no line end. NUL bytes at the end are left out.

    size: approximate bytes per chunk.
    remarks: notices about NUL bytes and about a cut gzip file are appended. If None, a cut file is refused.
    Raises InputError with the file's name if the file cannot be read.
    """
    name = name_of(source)
    if isinstance(source, (Path, str)) and Path(source).is_dir():
        raise InputError(f"{name} is a directory: give the name of a log in it")
    with errors_of(name):
        if isinstance(source, (Path, str)):
            with (
                open_input(source) as packed,
                cast(IO[bytes], gzip.open(packed)) if str(source).endswith(".gz") else packed as file,
            ):
                yield from _pieces(name, file, packed, size, remarks)
        else:
            yield from _pieces(name, source, source, size, remarks)


@contextlib.contextmanager
def errors_of(name: str) -> Iterator[None]:
    """A context that turns errors of reading and unpacking the file `name` into InputErrors."""
    try:
        yield
    except gzip.BadGzipFile as error:
        if "Not a gzipped" in str(error):
            raise InputError(f"{name} is not a gzip file: unpacked files have names without .gz") from error
        raise InputError(f"{name} is damaged: copy it again") from error
    except (EOFError, zlib.error, zipfile.BadZipFile, NotImplementedError) as error:
        raise InputError(f"{name} is damaged or cut short: copy it again") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{name} cannot be read: {cause(error)}") from error


def total_bytes(source: object) -> int:
    if isinstance(source, (Path, str)):
        return os.path.getsize(source) if os.path.isfile(source) else 0
    return 0


def _pieces(name: str, file: Any, packed: Any, size: int, remarks: list[Message] | None) -> Iterator[tuple[bytes, int]]:
    """Yield the chunks of an open file, as chunks() does.

    packed: the gzip file from which `file` is unpacked, or `file` itself. Its position shows how much was read.
    """
    pending, read = b"", 0
    for data in _data(file, size, remarks):
        read += len(data)
        pending += data
        if len(pending) > MOST_PENDING + size:
            raise InputError(f"{name}: {MOST_PENDING / 1e6:.0f} MB without the end of a line: it is not a log")
        if len(pending) >= size:
            cut = pending.rfind(b"\n") + 1 or pending.rfind(b"\r") + 1
            if cut:
                yield _with_line_feeds(pending[:cut]), read if packed is file else packed.tell()
                pending = pending[cut:]
    stripped = pending.rstrip(b"\0")
    if remarks is not None and len(stripped) < len(pending):
        remarks.append(NulEnd(len(pending) - len(stripped)))
        pending = stripped
    if pending:
        yield _with_line_feeds(pending), read if packed is file else packed.tell()


def _data(file: Any, size: int, remarks: list[Message] | None) -> Iterator[bytes]:
    """Yield the content of the file. A cut gzip file ends at the cut, if anything could be unpacked."""
    packed, has_data = isinstance(file, gzip.GzipFile), False
    while True:
        try:
            # read1() returns the data before a cut. read() would raise EOFError and lose that data.
            data = file.read1(size) if packed else file.read(size)
        except EOFError:
            if remarks is None or not has_data:
                raise
            remarks.append(CutGzip())
            return
        if not data:
            return
        has_data = True
        yield data.encode() if isinstance(data, str) else data


def _with_line_feeds(text: bytes) -> bytes:
    if b"\r" not in text:  # searching for one byte is fifty times as fast as searching for two bytes
        return text
    text = text.replace(b"\r\n", b"\n")
    return text if b"\n" in text else text.replace(b"\r", b"\n")
