"""Copies rides with mpremote from the board's flash or SD card to logs on the host."""

import binascii
import contextlib
import gzip
import itertools
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from mpremote.transport import TransportExecError

from ..common.messages import InputError
from ..common.output import check_directory, make_directory
from ..deploy.connection import (
    UPDATE,
    BrokenOff,
    ConnectedBoard,
    Port,
    Progress,
    connected,
    literal,
    printed,
    printed_lines,
    restart,
)
from . import ride_log
from .ride_log import CUT_SHORT, StoredBlock, missing_note, read

_SILENT_S = 60  # longest wait for an answer in s; an emulated board is slow

# Prints (directory, vehicle), then (ride, part, number of bytes, path) for each part of a ride in the directory
_LIST = """
import os
from kickstand import settings
try:
    from kickstand.rides import ride_files
except ImportError:  # firmware up to version 0.5.0
    from kickstand.rides import ride_paths as ride_files
chosen = settings.load()
directory = ride_files.directory(chosen)
print((directory, chosen.VEHICLE))
try:
    os.stat(directory)
except OSError:
    pass
else:
    for ride, part, size in ride_files.parts(directory):
        print((ride, part, size, ride_files.part_path(directory, ride, part)))
"""
# Prints a file in base64, then the length and the CRC-32 that the board computed
_READ = """
from binascii import b2a_base64, crc32
count, crc = 0, 0
with open(PATH, "rb") as file:
    while True:
        piece = file.read(1536)
        if not piece:
            break
        count, crc = count + len(piece), crc32(piece, crc)
        print(b2a_base64(piece).decode(), end="")
print((count, crc))
"""
_TRIES = 2  # attempts to copy a file


_Came = Callable[[str, int], None]  # called with the name of the item that is copied, and the number of new bytes


class _Part(NamedTuple):
    """A file of a ride on the board. ride, part: number of the ride and of its file. size: in bytes."""

    ride: int
    part: int
    size: int
    path: str


@dataclass
class PulledRide:
    """A ride that was copied from the board.

    log: the written file, with its calibration beside it, or None if the ride cannot be read.
    seconds, readings: duration of the log and its number of readings.
    problems: one line per fault.
    whole: True if everything was copied. An end that the board lost in a power cut does not count as missing.
    deleted: True if the ride was removed from the board.
    """

    number: int
    log: Path | None = None
    seconds: float = 0.0
    readings: int = 0
    problems: list[str] = field(default_factory=list)
    whole: bool = True
    deleted: bool = False


@dataclass(frozen=True)
class PullResult:
    """The copied rides, sorted by number, and the name of the board's port."""

    port: str
    rides: list[PulledRide]


def pull(
    port: Port,
    out: Path,
    delete: bool = False,
    progress: Progress | None = None,
    pulled: Callable[[PulledRide], None] | None = None,
) -> PullResult:
    """Write every ride on the board to a log in the directory `out`, then restart the board.

    port: the board's port, or a connected board; None for the only board that is plugged in.
    delete: True to remove each completely copied ride from the board.
    progress: called with (what, done, total), in bytes. pulled: called with each finished ride.
    Raises InputError if the rides cannot be copied.
    """
    check_directory(out)
    if not out.parent.is_dir():
        raise InputError(f"{out}: there is no directory {out.parent}: make it first")
    with connected(port) as (transport, name):
        try:
            directory, vehicle, rides = _list(transport, name)
            if rides:
                make_directory(out)
            result = PullResult(name, [])
            total, fetched = sum(part.size for parts in rides.values() for part in parts), 0

            def came(what: str, count: int) -> None:
                nonlocal fetched
                fetched += count
                if progress:
                    progress(what, fetched, total)

            for number, parts in rides.items():
                ride = _pull_ride(transport, number, parts, vehicle, out, came)
                if delete and ride.whole:
                    _delete(transport, directory, parts)
                    ride.deleted = True
                result.rides.append(ride)
                if pulled:
                    pulled(ride)
        finally:
            restart(transport)
    return result


def _list(transport: ConnectedBoard, name: str) -> tuple[str, str, dict[int, list[_Part]]]:
    """List the rides on the board: their directory, the vehicle in config.py, and {number of the ride: its parts}."""
    first, *lines = printed(transport, name, _LIST, "its rides").splitlines() or [b""]
    directory, vehicle = literal(first, (str, str))
    in_order = sorted(_Part(*literal(line, (int, int, int, str))) for line in lines)
    if not all(part.path.startswith(f"{directory}/") and part.ride < 100_000 for part in in_order):
        raise InputError(f"the board at {name} lists invalid rides", UPDATE)
    by_ride = itertools.groupby(in_order, lambda part: part.ride)
    return directory, vehicle, {ride: list(group) for ride, group in by_ride}


def _pull_ride(
    transport: ConnectedBoard, number: int, parts: list[_Part], vehicle: str, out: Path, came: _Came
) -> PulledRide:
    """Copy a ride and write its log. vehicle: from config.py, for an alignment by driving, because one by two poses is
    always a motorcycle's."""
    ride = PulledRide(number)
    title = f"ride {number}"
    blocks = _pull_blocks(transport, ride, parts, came)
    if not blocks:
        ride.problems.append(f"{title}: nothing in it can be read")
        ride.whole = False
        return ride
    missing = [following.sequence - previous.sequence - 1 for previous, following in itertools.pairwise(blocks)]
    if any(missing):
        ride.problems.append(f"{title}: {sum(missing)} blocks are missing: the log has a gap there")
    if missing_s := [seconds for block in blocks for seconds in block.missing_s()]:
        ride.problems.append(f"{title}: {missing_note(missing_s)}")
    first = blocks[0]
    if first.sequence:
        ride.problems.append(f"{title}: its beginning had to make room for later blocks")
    if first.calibration().by_drive:
        first.vehicle = vehicle
    ride.log = out / f"ride-{number:05}-{first.crc & 0xFFFF:04x}.csv.gz"
    if not ride.log.resolve().is_relative_to(out.resolve()):
        raise InputError(f"{ride.log} is a link to {ride.log.resolve()}: remove it, or give --out another directory")
    ride.readings = sum(len(block.turns) for block in blocks)
    if (earlier := _readings(ride.log)) > ride.readings:
        ride.problems.append(f"{ride.log} has more of this ride, {earlier} readings, and stays as it is")
        ride.log = _free_name(ride.log)
        ride.whole = False
    ride_log.write(ride.log, blocks)
    ride.seconds = (blocks[-1].turns[-1].time_us - first.time_us) / 1e6
    return ride


def _pull_blocks(transport: ConnectedBoard, ride: PulledRide, parts: list[_Part], came: _Came) -> list[StoredBlock]:
    """Copy the parts of a ride, and return the blocks that can be read. Faults are added to the ride."""
    blocks: list[StoredBlock] = []
    for part in parts:
        title = f"ride {ride.number}, part {part.part}"
        content, complete = _read(transport, part, title, came)
        if not complete:
            short = f"only {len(content)} of its {part.size} bytes arrived"
            wrong = short if len(content) < part.size else "some bytes arrived with errors"
            ride.problems.append(f"{title}: {wrong}: try another cable; if that fails, the flash or card is damaged")
            ride.whole = False
        blocks_read, problems = read(content)
        blocks += blocks_read
        for problem in problems:
            if problem == CUT_SHORT and complete and part is parts[-1]:
                ride.problems.append(f"{title}: the last block is cut short, as by a power cut: left out")
            else:
                ride.problems.append(f"{title}: {problem}: left out")
                ride.whole = False
    return blocks


def _delete(transport: ConnectedBoard, directory: str, parts: list[_Part]) -> None:
    """Remove the parts of one ride, and directories that are empty then."""
    for part in parts:
        transport.fs_rmfile(part.path)
    emptied = PurePosixPath(parts[0].path).parent
    with contextlib.suppress(OSError, TransportExecError):  # the directory contains other files
        while str(emptied) != directory:
            transport.fs_rmdir(str(emptied))
            emptied = emptied.parent


def _readings(log: Path) -> int:
    """Return the number of readings in an earlier log, or 0 if the log does not exist or cannot be read."""
    try:
        with gzip.open(log) as file:
            return sum(1 for _ in file) - 1
    except (OSError, EOFError, zlib.error):
        return 0


def _free_name(log: Path) -> Path:
    """Return the first of NAME-2.csv.gz, NAME-3.csv.gz ... that does not exist."""
    stem = log.name.removesuffix(".csv.gz")
    return next(path for n in itertools.count(2) if not (path := log.with_name(f"{stem}-{n}.csv.gz")).exists())


def _read(transport: ConnectedBoard, part: _Part, title: str, came: _Came) -> tuple[bytes, bool]:
    """Read a file of the board. Returns the bytes that arrived, and True if all announced bytes arrived unchanged."""
    # base64 needs four characters per three bytes, and two per line end. The file of a running recording may grow.
    code, most_bytes = _READ.replace("PATH", repr(part.path)), 2 * part.size + 9999
    longest = b""
    for attempt in range(_TRIES):
        content, answer = bytearray(), None
        if not attempt:
            came(f"pulling {title}", 0)
        try:
            for line in printed_lines(transport, code, _SILENT_S, most_bytes=most_bytes):
                if line.startswith(b"("):
                    answer = literal(line, (int, int))
                    continue
                with contextlib.suppress(binascii.Error):  # a byte was lost; the check sum will show the loss
                    piece = binascii.a2b_base64(line)
                    content += piece
                    if not attempt:
                        came(f"pulling {title}", len(piece))
        except BrokenOff as error:
            words = f"{part.path} did not arrive completely ({error}): try again, with another cable"
            raise InputError(words) from error
        if len(content) >= part.size and answer == (len(content), binascii.crc32(content)):
            return bytes(content), True
        longest = max(longest, bytes(content), key=len)
    return longest, False
