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

from kickstand_tools.common.errors import InputError, cause, extra
from kickstand_tools.common.output import whole_file
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_log
from kickstand_tools.logs.source import open_input

MOST_BYTES = 300_000_000  # largest (packed) log in a store: ten hours at 200 Hz have 150 million
_LONGEST = 100  # longest name in bytes; a file system takes 255, including the ending and a temporary name


def file_stem(readable: str, *exact: str) -> str:
    """A unique file name without ending: `readable`, changed where a file system would not take it, and a hash of
    `exact`. It is the same in every run.

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
    """text with the bytes that are not UTF-8 (in a file's name) replaced by their codes."""
    return text.encode("utf-8", "backslashreplace").decode()


def _quoted(text: str) -> str:
    return re.sub("%.?$", "", quote(_bytes(text), safe="")[:_LONGEST])


def _hash(*exact: str) -> str:
    return hashlib.sha256(b"\0".join(_bytes(part) for part in exact)).hexdigest()[:10]


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def is_remote(path: str) -> bool:
    """True for a path that only fsspec can open."""
    return "://" in path


def join(base: str, path: str) -> str:
    """path as seen from the directory base."""
    if is_remote(path) or Path(path).is_absolute():
        return path
    return f"{base.rstrip('/')}/{path}" if base else path


def read_bytes(path: str, most: int = MOST_BYTES) -> bytes:
    """Read a whole file of at most `most` bytes. Raises InputError."""
    if is_remote(path):
        with _in_store(path, "read") as (fs, place):
            content = fs.cat_file(place, end=most + 1)
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
        places = [_system(path)[1] for path in paths]
        found = fs.cat(places)
        return [found[place] for place in places]


def matches(pattern: str) -> list[str]:
    """The files that match a pattern with * ? [ ], sorted; ** matches any number of directories."""
    with _in_store(pattern, "read") as (fs, place):
        found = sorted(str(path) for path in fs.glob(place))
        return [fs.unstrip_protocol(path) for path in found] if is_remote(pattern) else found


def identities(paths: Iterable[str]) -> dict[str, str]:
    """For each path a mark that changes with the file: its ETag, or its size and time; "" without a file.

    Each remote directory is listed once.
    """
    known: dict[str, str] = {}
    directories: dict[str, dict[str, str]] = {}
    for path in paths:
        if not is_remote(path):
            try:
                stat = Path(path).stat()
                known[path] = f"{stat.st_size}-{stat.st_mtime_ns}"
            except (OSError, ValueError):  # a name that contains a NUL
                known[path] = ""
            continue
        parent = path.rpartition("/")[0]
        if parent not in directories:
            directories[parent] = listed(parent)
        known[path] = directories[parent].get(path, "")
    return known


def open_log(path: str) -> Log:
    """Read a log without checking its axes. Raises InputError."""
    if not is_remote(path):
        return read_log(path, axes=False)
    file: io.BytesIO = _Named(path, read_bytes(path))
    if path.endswith(".gz"):
        with gzip.GzipFile(filename=path, fileobj=file) as unpacked:
            return read_log(cast(IO[bytes], unpacked), axes=False)
    return read_log(file, axes=False)


class _Named(io.BytesIO):
    def __init__(self, name: str, content: bytes) -> None:
        super().__init__(content)
        self.name = name


def listed(parent: str) -> dict[str, str]:
    """For each file in a directory of a store, by path, a mark that changes with the file (see identities()). Empty if
    the directory does not exist. Raises InputError."""
    marks: dict[str, str] = {}
    with _in_store(parent, "read") as (fs, place), contextlib.suppress(FileNotFoundError):
        fs.invalidate_cache(place)
        for info in fs.ls(place, detail=True):
            time = info.get("ETag") or info.get("mtime") or info.get("LastModified") or ""
            marks[fs.unstrip_protocol(info["name"])] = f"{info.get('size')}-{time}"
    return marks


@contextlib.contextmanager
def _in_store(path: str, what: str) -> Iterator[tuple[Any, str]]:
    """A context with (file system, path in it) of a remote path. It turns any error of the libraries into an
    InputError."""
    try:
        yield _system(path)
    except InputError:
        raise
    except FileNotFoundError as error:
        instead = "there is no such file" if what == "read" else f"cannot be {what}: there is no such place"
        raise InputError(f"{path}: {instead}") from error
    except Exception as error:
        said = " ".join((cause(error)).split())
        raise InputError(f"{path} cannot be {what}: {said}") from error


def _system(path: str):
    try:
        import fsspec

        return fsspec.core.url_to_fs(path)
    except ImportError as error:
        name = "s3" if path.startswith("s3:") else "fleet"
        raise InputError(f"{path}: its library is not installed: {extra(name)}") from error
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error


def write_bytes(path: str, content: bytes) -> None:
    """Write a file, whole or not at all, and the directories for it. Raises InputError."""
    if is_remote(path):
        with _in_store(path, "written") as (fs, place):
            fs.pipe_file(place, content)
        return
    directory = Path(path).parent
    try:  # keep the directory if the write fails, because other workers use it too
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{directory} cannot be made: {cause(error)}") from error
    with whole_file(Path(path)) as temporary:
        temporary.write_bytes(content)


@contextlib.contextmanager
def to_write(path: str) -> Iterator[Path]:
    """A context with a temporary path to write to. At its end the file is moved to `path`, whole or not at all. Raises
    InputError."""
    if not is_remote(path):
        with whole_file(Path(path)) as temporary:
            yield temporary
        return
    with tempfile.TemporaryDirectory() as here:
        temporary = Path(here) / path.rpartition("/")[2]
        with whole_file(temporary) as begun:
            yield begun
        with _in_store(path, "written") as (fs, place):
            fs.put_file(str(temporary), place)
