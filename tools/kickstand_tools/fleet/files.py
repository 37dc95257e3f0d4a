"""Logs wherever fsspec reaches them: local files, s3:// and others."""

import gzip
import io
from collections.abc import Iterable
from pathlib import Path
from typing import IO, cast

from ..errors import InputError, cause, extra
from ..logs.log import Log
from ..logs.reader import read_log
from ..output import write_whole


def is_remote(path: str) -> bool:
    """True for a path that fsspec has to open."""
    return "://" in path


def join(base: str, path: str) -> str:
    """path as seen from the directory base."""
    if is_remote(path) or Path(path).is_absolute():
        return path
    return f"{base.rstrip('/')}/{path}" if base else path


def read_bytes(path: str) -> bytes:
    """A whole file. Raises InputError."""
    try:
        if is_remote(path):
            fs, place = _system(path)
            return fs.cat_file(place)
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file") from error
    except OSError as error:
        raise InputError(f"{path} cannot be read: {cause(error)}") from error


def matches(pattern: str) -> list[str]:
    """The files that a pattern with * ? [ ] stands for, sorted; ** reaches through directories."""
    fs, place = _system(pattern)
    found = sorted(str(path) for path in fs.glob(place))
    return [fs.unstrip_protocol(path) for path in found] if is_remote(pattern) else found


def identities(paths: Iterable[str]) -> dict[str, str]:
    """What tells that a file has changed, by path: its ETag, or its size and time; "" where there is no file.

    Remote directories are listed once each.
    """
    known: dict[str, str] = {}
    listed: dict[str, dict[str, str]] = {}
    for path in paths:
        if not is_remote(path):
            try:
                stat = Path(path).stat()
                known[path] = f"{stat.st_size}-{stat.st_mtime_ns}"
            except OSError:
                known[path] = ""
            continue
        parent = path.rpartition("/")[0]
        if parent not in listed:
            listed[parent] = _listed(parent)
        known[path] = listed[parent].get(path, "")
    return known


def open_log(path: str) -> Log:
    """Read a log, without judging its axes. Raises InputError."""
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


def _listed(parent: str) -> dict[str, str]:
    fs, place = _system(parent)
    try:
        found = fs.ls(place, detail=True)
    except FileNotFoundError:
        return {}
    marks = {}
    for info in found:
        time = info.get("ETag") or info.get("mtime") or info.get("LastModified") or ""
        marks[fs.unstrip_protocol(info["name"])] = f"{info.get('size')}-{time}"
    return marks


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
        fs, place = _system(path)
        fs.pipe_file(place, content)
        return
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target.parent} cannot be made: {cause(error)}") from error

    def write(temporary: Path) -> None:
        temporary.write_bytes(content)

    write_whole(target, write)
