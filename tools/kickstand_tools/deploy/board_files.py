"""Lists the files on a board's flash with their hashes, its folders, and its free flash blocks."""

import hashlib
from dataclasses import dataclass

from mpremote.transport_serial import SerialTransport

from .connection import literal
from .firmware_files import PACKAGE

# This program runs on the board, and prints these lines:
#   (path, size, SHA-256)              for each file in the root and below the package's folder
#   (path, None, None)                 for the package's folder and each folder below it
#   the folder of rides                if it contains rides
#   (bytes of a block, free blocks)    for the flash
_SURVEY = """
import hashlib, os
def survey(directory):
    for entry in os.ilistdir(directory or "/"):
        path = directory + "/" + entry[0]
        if entry[1] & 0x4000:
            if (path + "/").startswith("{PACKAGE}/"):
                print((path, None, None))
                survey(path)
            continue
        digest, size = hashlib.sha256(), 0
        with open(path, "rb") as file:
            while True:
                block = file.read(1024)
                if not block:
                    break
                size += len(block)
                digest.update(block)
        print((path, size, digest.digest()))
survey("")
if any("/" + entry[0] == "{RIDES}" for entry in os.ilistdir("/")) and list(os.ilistdir("{RIDES}")):
    print("{RIDES}")
s = os.statvfs("/")
print((s[0], s[3]))
"""
_RIDES = "/rides"  # folder of the rides in flash, see kickstand.rides.ride_files.directory()

Fingerprint = tuple[int, bytes]


@dataclass(frozen=True)
class BoardFiles:
    """The files on a board's flash.

    files: size in bytes and SHA-256 of each file in the root and in the package, by path.
    folders: the package's folder and the folders below it.
    block, free_blocks: bytes of a flash block, and the number of free blocks.
    has_rides: True if the flash contains rides.
    """

    files: dict[str, Fingerprint]
    folders: frozenset[str]
    block: int
    free_blocks: int
    has_rides: bool


def survey(transport: SerialTransport) -> BoardFiles:
    """List the files on the board's flash."""
    code = _SURVEY.replace("{PACKAGE}", PACKAGE).replace("{RIDES}", _RIDES)
    *lines, last = transport.exec(code).splitlines() or [b""]
    has_rides = _RIDES.encode() in lines[-1:]
    entries = [literal(line, (str, int, bytes), (str, None, None)) for line in lines[: len(lines) - has_rides]]
    block, free_blocks = literal(last, (int, int))
    return BoardFiles(
        {path: (size, digest) for path, size, digest in entries if size is not None},
        frozenset(path for path, size, _ in entries if size is None),
        block,
        free_blocks,
        has_rides,
    )


def fingerprint(data: bytes) -> Fingerprint:
    """Return the size and the SHA-256 of data, as in BoardFiles.files."""
    return len(data), hashlib.sha256(data).digest()
