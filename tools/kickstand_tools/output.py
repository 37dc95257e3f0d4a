"""Writes files completely or not at all, and makes the directories for them."""

import contextlib
import gzip
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from .errors import InputError, cause


def check_output(path: Path, inputs: list[Path]) -> None:
    """Refuse, before any work is done, an output that could not be written or that would destroy an input."""
    if path.is_dir():
        raise InputError(f"{path} is a directory: give --out the name of a file")
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is not an ordinary file: give --out the name of one")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no directory {path.parent}: make it first")
    for source in inputs:
        if path.exists() and source.exists() and path.samefile(source):
            raise InputError(f"{path} is also an input: give --out another name")


def check_directory(path: Path) -> None:
    """Refuse, before any work is done, a directory to write to if that is a file."""
    if path.exists() and not path.is_dir():
        raise InputError(f"{path} is a file: give --out the name of a directory")


@contextlib.contextmanager
def new_directory(path: Path) -> Iterator[None]:
    """Make a directory and those above it. Those that are empty at the end of the `with` are removed again."""
    made: list[Path] = []
    try:
        try:
            made = [one for one in (path, *path.parents) if not one.exists()]
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path} cannot be made: {cause(error)}") from error
        yield
    finally:
        with contextlib.suppress(OSError):  # not empty
            for one in made:
                one.rmdir()


@contextlib.contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A temporary path to write to; at the end of the `with` that file becomes path. If it fails, a file that was at
    path stays. Raises InputError.

    The temporary name has the ending of path, from which libraries tell the format.
    """
    path = path.resolve()  # a symbolic link stays one
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {cause(error)}; choose another place") from error
    finally:
        with contextlib.suppress(OSError):  # on a read-only file system it would hide the reason
            temporary.unlink(missing_ok=True)


def write_packed(path: Path, parts: Iterable[bytes]) -> None:
    """Write a file of these parts, gzipped if its name ends in .gz, whole or not at all. Raises InputError."""
    opened = gzip.open if path.suffix == ".gz" else open
    with whole_file(path) as temporary, opened(temporary, "wb") as file:
        file.writelines(parts)
