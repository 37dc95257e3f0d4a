"""Writes files completely or not at all, and makes their directories."""

import contextlib
import errno
import gzip
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from .messages import InputError, cause

_MOST_LINKS = 40  # number of links that are followed, as in Linux


def check_output(path: Path, inputs: list[Path]) -> None:
    """Refuse an output that cannot be written or that would destroy an input. Call this before any work is done."""
    _resolved(path)
    if path.is_dir():
        raise InputError(f"{path} is a directory: give --out the name of a file")
    if _is_open_here(path):  # replacing a file that the shell has opened would lose its content
        raise InputError(f"{path} is this command's own input or output: give --out the name of another file")
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is not an ordinary file: give --out the name of one")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no directory {path.parent}: make it first")
    for source in inputs:
        if path.exists() and source.exists() and path.samefile(source):
            raise InputError(f"{path} is also an input: give --out another name")


def _resolved(path: Path) -> Path:
    """Return the path without symbolic links. Raises InputError if the links form a circle."""
    try:
        return path.resolve()
    except (OSError, RuntimeError) as error:  # before Python 3.13, links in a circle raise RuntimeError
        raise InputError(f"{path} cannot be followed: its links form a circle: give --out another place") from error


def _is_open_here(path: Path) -> bool:
    """Return True if the path is an open file of this process: /dev/stdin, /dev/stdout, /dev/stderr or /dev/fd/3."""
    with contextlib.suppress(OSError):
        status = path.stat()
        for number in (0, 1, 2):
            with contextlib.suppress(OSError):
                if os.path.samestat(os.fstat(number), status) and path.is_file():
                    return True
    target = Path(os.path.abspath(path))
    for _ in range(_MOST_LINKS):  # /dev/stdout is a link to /proc/self/fd/1
        if target.is_relative_to("/dev/fd") or (target.is_relative_to("/proc") and target.parent.name == "fd"):
            return True
        if not target.is_symlink():
            return False
        target = Path(os.path.abspath(target.parent / os.readlink(target)))
    return False


def check_directory(path: Path) -> None:
    """Refuse an output directory that is a file. Call this before any work is done."""
    _resolved(path)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path} is a file: give --out the name of a directory")


@contextlib.contextmanager
def new_directory(path: Path) -> Iterator[None]:
    """Make a directory and its parents. At the end of the `with`, new directories that are still empty are removed."""
    created: list[Path] = []
    try:
        try:
            created = [folder for folder in (path, *path.parents) if not folder.exists()]
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path} cannot be made: {cause(error)}") from error
        yield
    finally:
        with contextlib.suppress(OSError):  # not empty
            for folder in created:
                folder.rmdir()


def make_directory(path: Path) -> None:
    """Make a directory and its parents if they do not exist. Raises InputError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path} cannot be made: {cause(error)}: give --out another place") from error


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A context that yields a temporary path to write to. At its end, the file is renamed to `path`.

    The finished file survives a power loss. If writing fails, an earlier file at `path` remains. The temporary name has
    the same ending as `path`, because libraries choose the format by the ending. Raises InputError.
    """
    path = _resolved(path)  # replace the target of a symbolic link, not the link
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        yield temporary
        flush_to_disk(temporary)
        os.replace(temporary, path)
        flush_to_disk(path.parent)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {cause(error)}; choose another place") from error
    finally:
        # An error here, for example on a read-only file system, must not hide the first error
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def flush_to_disk(path: Path) -> None:
    """Wait until a file, or the entries of a directory, are on the disk. Raises OSError.

    Otherwise a power loss could leave neither the old nor the new content, only the new name (see fsync(2)).
    """
    directory = path.is_dir()
    # A browser has no disk, and Windows cannot open directories
    if sys.platform == "emscripten" or (directory and os.name == "nt"):
        return
    number = os.open(path, os.O_RDONLY if directory else os.O_RDWR)
    try:
        os.fsync(number)
    except OSError as error:
        if not (directory and error.errno in (errno.EINVAL, errno.ENOTSUP)):  # network disks may not flush directories
            raise
    finally:
        os.close(number)


def write_packed(path: Path, parts: Iterable[bytes]) -> None:
    """Write bytes to a file, completely or not at all. Gzip the file if its name ends in .gz. Raises InputError."""
    opened = gzip.open if path.suffix == ".gz" else open
    with whole_file(path) as temporary, opened(temporary, "wb") as file:
        file.writelines(parts)
