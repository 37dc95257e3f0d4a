"""The Pico's file system, built and read on the host: littlefs with the geometry of the official image."""

import tempfile
from pathlib import Path

from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import Store
from littlefs import LittleFS, UserContext

from ..deploy import bytecode, firmware_files

START = 0xA0000  # address of the file system in flash
_BLOCK, _COUNT = 4096, 352
SIZE = _BLOCK * _COUNT
_PROGRAM_SIZE = 256


def build(files: dict[str, bytes]) -> bytes:
    """A file system that holds these files: {path on the board, with or without a leading slash: content}."""
    context = UserContext(SIZE)
    system = _mount(context, fresh=True)
    for path, content in files.items():
        path = path.lstrip("/")
        if "/" in path:
            system.makedirs(path.rpartition("/")[0], exist_ok=True)
        with system.open(path, "wb") as file:
            file.write(content)
    system.unmount()
    return bytes(context.buffer)


def read(image: bytes) -> dict[str, bytes]:
    """Every file of a file system, by path. Raises littlefs.errors.LittleFSError if it cannot be mounted."""
    context = UserContext(SIZE)
    context.buffer = bytearray(image)
    system = _mount(context, fresh=False)
    files = {}
    for directory, _, names in system.walk("/"):
        for name in names:
            path = f"{directory.rstrip('/')}/{name}"
            with system.open(path, "rb") as file:
                files[path.lstrip("/")] = file.read()
    return files


def firmware(compiled: bool = False) -> dict[str, bytes]:
    """The files that `kickstand flash` copies to a board. compiled: the package as .mpy, made by mpy-cross."""
    return firmware_files.contents(bytecode.PICO if compiled else None)


def stored(calibration: Calibration, who_am_i: int = 0x68, accel_range_g: int = 8) -> dict[str, bytes]:
    """The files in which a board keeps this calibration."""
    with tempfile.TemporaryDirectory() as directory:
        Store(who_am_i, accel_range_g, directory).save(calibration)
        return {path.name: path.read_bytes() for path in Path(directory).iterdir()}


def _mount(context: UserContext, fresh: bool) -> LittleFS:
    system = LittleFS(context, mount=False, block_size=_BLOCK, block_count=_COUNT, prog_size=_PROGRAM_SIZE)
    if fresh:
        system.format()
    system.mount()
    return system
