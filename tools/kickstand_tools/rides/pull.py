"""Rides from the board's flash or SD card to logs on the host, by mpremote."""

import ast
import binascii
import contextlib
import itertools
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from mpremote.transport import TransportExecError
from mpremote.transport_serial import SerialTransport

from ..deploy.board_console import BrokenOff, lines
from ..deploy.flash import connected, refuse_absent, restart
from ..errors import InputError
from ..output import check_directory
from ..progress import Bar
from . import ride_log
from .block_reader import CUT_SHORT, Block, read

Print = Callable[[str], None]

_SILENT_S = 60  # an emulated board takes a while

# Prints the directory, and (ride, part, bytes, path) of each part in it
_LIST = """
import os
from kickstand import settings
from kickstand.rides import ride_paths
directory = ride_paths.directory(settings.load())
print(repr(directory))
try:
    os.stat(directory)
except OSError:
    pass
else:
    for ride, part, size in ride_paths.parts(directory):
        print((ride, part, size, ride_paths.part_path(directory, ride, part)))
"""
_READ = """
from binascii import b2a_base64
with open(PATH, "rb") as file:
    while True:
        piece = file.read(1536)
        if not piece:
            break
        print(b2a_base64(piece).decode(), end="")
"""


class _Part(NamedTuple):
    """A file on the board. size: bytes."""

    ride: int
    part: int
    size: int
    path: str


def pull(port: str | None, out: Path, delete: bool, say: Print, warn: Print) -> None:
    """Write every ride on the board to a log in the directory out. Raises InputError.

    delete: afterwards remove from the board those that came over whole.
    """
    check_directory(out)
    if not out.parent.is_dir():
        raise InputError(f"{out}: there is no directory {out.parent}: make it first")
    with connected(port) as (transport, name):
        try:
            directory, rides = _list(transport, name)
            if not rides:
                say(f"no rides on the board at {name}: its menu's Record ride makes one")
                return
            out.mkdir(exist_ok=True)
            with Bar("pulling", sum(part.size for parts in rides.values() for part in parts)) as bar:
                for ride, parts in rides.items():
                    whole = _pull_ride(transport, ride, parts, out, bar, say, warn)
                    if delete and whole:
                        _delete(transport, directory, parts)
                        say(f"deleted from the board: ride {ride}")
                    elif delete:
                        warn(f"ride {ride}: not deleted from the board, because not all of it came over")
        finally:
            restart(transport)


def _list(transport: SerialTransport, name: str) -> tuple[str, dict[int, list[_Part]]]:
    """Where the rides are, and the parts of each."""
    listed, error = transport.exec_raw(_LIST, timeout=_SILENT_S)
    if error:
        reason = error.decode(errors="replace").strip().rpartition("\n")[2]
        if "CardError" in reason or "SettingsError" in reason:
            raise InputError(f"{name}: {reason.partition(': ')[2]}")
        refuse_absent(reason, name)
        raise InputError(f"the board at {name} cannot tell its rides ({reason}): kickstand flash brings it up to date")
    directory, *parts = map(ast.literal_eval, listed.decode().splitlines())
    in_order = sorted(_Part(*part) for part in parts)
    return directory, {ride: list(group) for ride, group in itertools.groupby(in_order, lambda part: part.ride)}


def _pull_ride(
    transport: SerialTransport, ride: int, parts: list[_Part], out: Path, bar: Bar, say: Print, warn: Print
) -> bool:
    """Write its log. True if all of it came over."""
    blocks: list[Block] = []
    whole = True
    for part in parts:
        title = f"ride {ride}, part {part.part}"
        bar.describe(f"pulling {title}")
        found, problems = read(_read(transport, part.path, bar))
        blocks += found
        for problem in problems:
            if problem == CUT_SHORT:
                warn(f"{title}: the last block is cut short, as by a power cut: left out")
            else:
                warn(f"{title}: {problem}: left out")
                whole = False
    title = f"ride {ride}"
    if not blocks:
        warn(f"{title}: nothing in it can be read")
        return False
    missing = [after.sequence - before.sequence - 1 for before, after in itertools.pairwise(blocks)]
    if any(missing):
        warn(f"{title}: {sum(missing)} blocks are missing: the log has a gap there")
    if blocks[0].sequence:
        warn(f"{title}: its beginning had to make room for later blocks")
    path = out / f"ride-{ride:05}-{blocks[0].crc & 0xFFFF:04x}.csv.gz"
    ride_log.write(path, blocks)
    seconds = (blocks[-1].turns[-1].time_us - blocks[0].time_us) / 1e6
    say(f"written: {path}, {seconds / 60:.1f} min, {sum(len(block.turns) for block in blocks)} readings")
    return whole


def _delete(transport: SerialTransport, directory: str, parts: list[_Part]) -> None:
    """Parts of one ride, and the directories that are empty then."""
    for part in parts:
        transport.fs_rmfile(part.path)
    emptied = PurePosixPath(parts[0].path).parent
    with contextlib.suppress(OSError, TransportExecError):  # something else is in it
        while str(emptied) != directory:
            transport.fs_rmdir(str(emptied))
            emptied = emptied.parent


def _read(transport: SerialTransport, path: str, bar: Bar) -> bytes:
    """A file of the board."""
    content = b""
    try:
        for line in lines(transport, _READ.replace("PATH", repr(path)), _SILENT_S):
            piece = binascii.a2b_base64(line)
            content += piece
            bar.advance(len(piece))
    except (BrokenOff, binascii.Error) as error:
        raise InputError(f"{path} did not come over whole ({error}): try again, with another cable") from error
    return content
