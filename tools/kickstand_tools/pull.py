"""Rides from the board's flash or SD card to logs on the host, by mpremote."""

import ast
import binascii
import itertools
from collections.abc import Callable
from pathlib import Path

from mpremote.transport_serial import SerialTransport

from . import ride_log
from .board_console import BrokenOff, lines
from .deploy import connected, restart
from .errors import InputError
from .progress import Bar
from .ride_blocks import CUT_SHORT, Block, read

Print = Callable[[str], None]

_SILENT_S = 60  # an emulated board takes a while

# Prints the directory and (name, bytes) of each part of a ride
_LIST = """
import os
from kickstand import ride_ring, settings
directory = ride_ring.directory(settings.load())
try:
    parts = sorted((entry[0], entry[3]) for entry in os.ilistdir(directory) if entry[0].endswith(ride_ring.ENDING))
except OSError:
    parts = []
print((directory, parts))
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


def pull(port: str | None, out: Path, delete: bool, say: Print, warn: Print) -> None:
    """Write every ride on the board to a log in the directory out. Raises InputError.

    delete: afterwards remove from the board those that came over whole.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is not a directory: give --out the name of one")
    if not out.parent.is_dir():
        raise InputError(f"{out}: there is no directory {out.parent}: make it first")
    with connected(port) as (transport, name):
        try:
            directory, rides = _list(transport, name)
            if not rides:
                say(f"no rides on the board at {name}: its menu's Record ride makes one")
                return
            out.mkdir(exist_ok=True)
            with Bar("pulling", sum(size for parts in rides.values() for _, size in parts)) as bar:
                for parts in rides.values():
                    _pull_ride(transport, directory, [name for name, _ in parts], out, delete, bar, say, warn)
        finally:
            restart(transport)


def _list(transport: SerialTransport, name: str) -> tuple[str, dict[str, list[tuple[str, int]]]]:
    """Where the rides are, and the parts of each by the number in their names."""
    listed, error = transport.exec_raw(_LIST, timeout=_SILENT_S)
    if error:
        reason = error.decode(errors="replace").strip().rpartition("\n")[2]
        if "CardError" in reason or "SettingsError" in reason:
            raise InputError(f"{name}: {reason.partition(': ')[2]}")
        raise InputError(f"the board at {name} cannot tell its rides ({reason}): kickstand flash brings it up to date")
    directory, parts = ast.literal_eval(listed.decode())
    return directory, {key: list(group) for key, group in itertools.groupby(parts, lambda part: part[0][:5])}


def _pull_ride(
    transport: SerialTransport,
    directory: str,
    names: list[str],
    out: Path,
    delete: bool,
    bar: Bar,
    say: Print,
    warn: Print,
) -> None:
    blocks: list[Block] = []
    whole = True
    for name in names:
        bar.describe(f"pulling {name}")
        found, problems = read(_read(transport, f"{directory}/{name}", bar))
        blocks += found
        for problem in problems:
            if problem == CUT_SHORT:
                warn(f"{name}: the last block is cut short, as by a power cut: left out")
            else:
                warn(f"{name}: {problem}: left out")
                whole = False
    title = f"ride {int(names[0][:5])}" if names[0][:5].isdigit() else names[0]
    if not blocks:
        warn(f"{title}: nothing in it can be read; it stays on the board")
        return
    missing = [after.sequence - before.sequence - 1 for before, after in itertools.pairwise(blocks)]
    if any(missing):
        warn(f"{title}: {sum(missing)} blocks are missing: the log has a gap there")
    if blocks[0].sequence:
        warn(f"{title}: its beginning had to make room for later blocks")
    path = out / f"ride-{names[0][:5]}-{blocks[0].crc & 0xFFFF:04x}.csv.gz"
    ride_log.write(path, blocks)
    seconds = (blocks[-1].turns[-1].time_us - blocks[0].time_us) / 1e6
    say(f"written: {path}, {seconds / 60:.1f} min, {sum(len(block.turns) for block in blocks)} readings")
    if not delete:
        return
    if whole:
        for name in names:
            transport.fs_rmfile(f"{directory}/{name}")
        say(f"deleted from the board: {title}")
    else:
        warn(f"{title}: not deleted from the board, because not all of it came over")


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
