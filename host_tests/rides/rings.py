"""Common helpers for the tests of rides in flash."""

import types

from kickstand.rides import ride_files
from kickstand.rides.ride_files import RideFiles

FLASH = types.SimpleNamespace(SD_SPI=None)
KB_4 = 4096
opened: list[RideFiles] = []  # the rings of this test, whose files are closed at its end


def ride_ring(settings):
    opened.append(RideFiles(settings))
    return opened[-1]


def write_block(ring, size=100):
    """Write a block of a ride. Return the number of steps until the ring was ready."""
    steps = 0
    while not ring.ready():
        steps += 1
    ring.write(b"x" * size)
    ring.end_block()
    return steps


def old_ride(root, ride, parts=1, size=KB_4):
    directory = root.path / ride_files.ride_path("rides", ride)
    directory.mkdir(parents=True, exist_ok=True)
    for part in range(parts):
        (root.path / ride_files.part_path("rides", ride, part)).write_bytes(bytes(size))
    return directory
