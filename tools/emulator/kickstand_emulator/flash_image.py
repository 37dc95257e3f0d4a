"""Builds and reads a board's file system on the host: littlefs with the geometry of the official image."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import Store
from littlefs import LittleFS, UserContext


@dataclass(frozen=True)
class FileSystem:
    """The position of a board's littlefs in its flash, and the sizes with which MicroPython mounts it."""

    start: int  # first byte in the flash
    blocks: int  # number of blocks
    cache: int  # size of a read or a write, in bytes
    block = 4096  # size of a block, in bytes

    @property
    def size(self) -> int:
        return self.block * self.blocks

    def build(self, files: dict[str, bytes]) -> bytes:
        """Return a file system with these files, as {path with or without a leading slash: content}."""
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
        """Return all files of a file system, as {path without a leading slash: content}.

        Raises littlefs.errors.LittleFSError if the file system cannot be mounted.
        """
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
        """Mount the file system. fresh: True to format it first."""
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


def stored(calibration: Calibration, who_am_i: int = 0x68) -> dict[str, bytes]:
    """Return the files in which a board stores this calibration. The sensor's range is 8 g.

    who_am_i: the sensor's WHO_AM_I register.
    """
    with tempfile.TemporaryDirectory() as directory:
        Store(who_am_i, 8, directory).save(calibration)
        return {path.name: path.read_bytes() for path in Path(directory).iterdir()}
