"""A board's file system, built and read on the host: littlefs with the geometry of the official image."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import Store
from kickstand_tools.deploy import bytecode, firmware_files
from littlefs import LittleFS, UserContext


@dataclass(frozen=True)
class FileSystem:
    """The place of a board's littlefs in its flash, in bytes, and how MicroPython mounts it."""

    start: int
    blocks: int
    cache: int  # the size of its reads and writes
    block = 4096

    @property
    def size(self) -> int:
        """The size of the file system, bytes."""
        return self.block * self.blocks

    def build(self, files: dict[str, bytes]) -> bytes:
        """A file system that holds these files: {path on the board, with or without a leading slash: content}."""
        context = UserContext(self.size)
        system = self._mount(context, fresh=True)
        for path, content in files.items():
            path = path.lstrip("/")
            if "/" in path:
                system.makedirs(path.rpartition("/")[0], exist_ok=True)
            with system.open(path, "wb") as file:
                file.write(content)
        system.unmount()
        return bytes(context.buffer)

    def read(self, image: bytes) -> dict[str, bytes]:
        """All files of a file system, by path. Raises littlefs.errors.LittleFSError if it cannot be mounted."""
        context = UserContext(self.size)
        context.buffer = bytearray(image)
        system = self._mount(context, fresh=False)
        files = {}
        for directory, _, names in system.walk("/"):
            for name in names:
                path = f"{directory.rstrip('/')}/{name}"
                with system.open(path, "rb") as file:
                    files[path.lstrip("/")] = file.read()
        return files

    def _mount(self, context: UserContext, fresh: bool) -> LittleFS:
        system = LittleFS(
            context,
            mount=False,
            block_size=self.block,
            block_count=self.blocks,
            prog_size=self.cache,
            read_size=self.cache,
        )
        if fresh:
            system.format()
        system.mount()
        return system


PICO = FileSystem(0xA0000, 352, 256)
ESP32 = FileSystem(0x200000, 512, 32)


def firmware(compiled: bool = False, mpy: int = bytecode.PICO) -> dict[str, bytes]:
    """The files that `kickstand flash` copies to a board. compiled: the package as .mpy, made by mpy-cross.

    mpy: the board's sys.implementation._mpy.
    """
    return firmware_files.contents(mpy if compiled else None)


def stored(calibration: Calibration, who_am_i: int = 0x68) -> dict[str, bytes]:
    """The files in which a board with this sensor, in its range of 8 g, stores this calibration."""
    with tempfile.TemporaryDirectory() as directory:
        Store(who_am_i, 8, directory).save(calibration)
        return {path.name: path.read_bytes() for path in Path(directory).iterdir()}
