"""Reads and writes files through fsspec: local files, s3:// and others."""

import contextlib
import gzip
import hashlib
import io
import re
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any, cast
from urllib.parse import quote

from kickstand_tools.checks.log import read_with_notices
from kickstand_tools.common.installation import leaf
from kickstand_tools.common.messages import InputError, cause
from kickstand_tools.common.output import whole_file
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.source import open_input

MOST_BYTES = 300_000_000  # largest packed log in a store, in bytes. Ten hours at 200 Hz use 150 million bytes
# Longest encoded name, in bytes. A file system allows 255 bytes, including the file's ending and the prefix of a
# temporary file
_LONGEST = 100


def file_stem(readable: str, *exact: str) -> str:
    """Return a unique file name without its ending. The name is the same in every run.

    readable: Text that begins the name. Characters that a file system does not allow are encoded.
    exact: Texts that identify the file. The name ends with a hash of these texts.

    >>> file_stem(".bus 12", "bus 12", "front")
    'bus%2012-e9a9b5c8f0'
    """
    return f"{_quoted(readable).lstrip('.')}-{_hash(*exact)}"


def folder_value(value: str) -> str:
    """Encode value for a folder named KEY=VALUE, which data frames read. A very long value is cut and made unique.

    >>> folder_value("bus 12"), len(folder_value(300 * "x"))
    ('bus%2012', 111)
    """
    return _quoted(value) if len(quote(_bytes(value), safe="")) <= _LONGEST else f"{_quoted(value)}-{_hash(value)}"


def printable(text: str) -> str:
    """Return text with each byte that is not UTF-8 replaced by its code. Names of files may contain such bytes."""
    return text.encode("utf-8", "backslashreplace").decode()


def _quoted(text: str) -> str:
    return re.sub("%.?$", "", quote(_bytes(text), safe="")[:_LONGEST])


def _hash(*exact: str) -> str:
    return hashlib.sha256(b"\0".join(_bytes(part) for part in exact)).hexdigest()[:10]


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def is_remote(path: str) -> bool:
    return "://" in path


def join(base: str, path: str) -> str:
    """Return the path, relative to the directory base unless it is absolute or remote."""
    if is_remote(path) or Path(path).is_absolute():
        return path
    return f"{base.rstrip('/')}/{path}" if base else path


def read_bytes(path: str, most: int = MOST_BYTES) -> bytes:
    """Read a whole file of at most `most` bytes. Raises InputError."""
    if is_remote(path):
        with _in_store(path, "read") as (fs, name):
            content = fs.cat_file(name, end=most + 1)
    else:
        try:
            with open_input(path) as file:
                content = file.read(most + 1)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {cause(error)}") from error
    if len(content) > most:
        raise InputError(f"{path} is too large: over {most / 1e6:.0f} MB")
    return content


def read_all(paths: list[str]) -> list[bytes]:
    """Read whole files of one store, fetched together. Raises InputError."""
    with _in_store(paths[0], "read") as (fs, _):
        names = [_system(path)[1] for path in paths]
        contents = fs.cat(names)
        return [contents[name] for name in names]


def matches(pattern: str) -> list[str]:
    """The files that match a pattern with * ? [ ], sorted. ** matches any number of directories."""
    with _in_store(pattern, "read") as (fs, name):
        names = sorted(str(path) for path in fs.glob(name))
        return [fs.unstrip_protocol(path) for path in names] if is_remote(pattern) else names


def identities(paths: Iterable[str]) -> dict[str, str]:
    """Return a mark for each path, which changes when the file changes.

    A mark consists of the file's size, and its time or its ETag. It is "" if the file does not exist. Each remote
    directory is listed only once.
    """
    marks: dict[str, str] = {}
    directories: dict[str, dict[str, str]] = {}
    for path in paths:
        if not is_remote(path):
            try:
                stat = Path(path).stat()
                marks[path] = f"{stat.st_size}-{stat.st_mtime_ns}"
            except (OSError, ValueError):  # ValueError: the name contains a NUL
                marks[path] = ""
            continue
        parent = path.rpartition("/")[0]
        if parent not in directories:
            directories[parent] = listed(parent)
        marks[path] = directories[parent].get(path, "")
    return marks


def open_log(path: str) -> Log:
    """Read a log without checking its axes. Raises InputError."""
    if not is_remote(path):
        return read_with_notices(path, axes=False)
    file: io.BytesIO = _Named(path, read_bytes(path))
    if path.endswith(".gz"):
        with gzip.GzipFile(filename=path, fileobj=file) as unpacked:
            return read_with_notices(cast(IO[bytes], unpacked), axes=False)
    return read_with_notices(file, axes=False)


class _Named(io.BytesIO):
    def __init__(self, name: str, content: bytes) -> None:
        super().__init__(content)
        self.name = name


def listed(parent: str) -> dict[str, str]:
    """Return the mark of each file in a directory (see identities()), by its path.

    If the directory does not exist, the result is empty. Raises InputError if it cannot be read.
    """
    marks: dict[str, str] = {}
    with _in_store(parent, "read") as (fs, name), contextlib.suppress(FileNotFoundError):
        fs.invalidate_cache(name)
        for info in fs.ls(name, detail=True):
            time = info.get("ETag") or info.get("mtime") or info.get("LastModified") or ""
            marks[fs.unstrip_protocol(info["name"])] = f"{info.get('size')}-{time}"
    return marks


@contextlib.contextmanager
def _in_store(path: str, action: str) -> Iterator[tuple[Any, str]]:
    """A context with the file system of a path, and the path within it. Any error becomes an InputError.

    action: the past participle of the attempted action, for the message.
    """
    try:
        yield _system(path)
    except InputError:
        raise
    except FileNotFoundError as error:
        words = "there is no such file" if action == "read" else f"cannot be {action}: there is no such place"
        raise InputError(f"{path}: {words}") from error
    except Exception as error:
        reason = " ".join((cause(error)).split())
        raise InputError(f"{path} cannot be {action}: {reason}") from error


def _system(path: str):
    import fsspec

    try:
        return fsspec.core.url_to_fs(path)
    except ImportError as error:
        install = leaf("fleet[s3]") if path.startswith("s3:") else cause(error)
        raise InputError(f"{path}: its library is not installed: {install}") from error
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error


def write_bytes(path: str, content: bytes) -> None:
    """Write a file completely or not at all. Create its directory if needed. Raises InputError."""
    if is_remote(path):
        with _in_store(path, "written") as (fs, name):
            fs.pipe_file(name, content)
        return
    directory = Path(path).parent
    try:  # a new directory stays if the write fails, because other workers use it too
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{directory} cannot be made: {cause(error)}") from error
    with whole_file(Path(path)) as temporary:
        temporary.write_bytes(content)


@contextlib.contextmanager
def to_write(path: str) -> Iterator[Path]:
    """A context that yields a temporary path, and at its end moves the complete file to `path`. Raises InputError."""
    if not is_remote(path):
        with whole_file(Path(path)) as temporary:
            yield temporary
        return
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / path.rpartition("/")[2]
        with whole_file(temporary) as partial:
            yield partial
        with _in_store(path, "written") as (fs, name):
            fs.put_file(str(temporary), name)
