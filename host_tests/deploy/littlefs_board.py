"""A fake board with a real littlefs as its flash. Files use as many blocks as on a board, and a full flash refuses
them."""

import contextlib
import errno
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kickstand_tools.deploy import firmware_files
from littlefs import LittleFS, UserContext
from littlefs.errors import LittleFSError
from support import fake_board

BLOCK = 4096
# The program size and the cache size in bytes with which each port of MicroPython mounts the file system.
PORTS = {"rp2": (256, 1024), "esp32": (32, 128)}


class _Flash(UserContext):
    """A UserContext that does not log each read. Logging would take ten times as long as the read."""

    def read(self, cfg: Any, block: int, off: int, size: int) -> bytearray:
        start = block * cfg.block_size + off
        return self.buffer[start : start + size]


class LittlefsBoard(fake_board.FakeBoard):
    """A fake board with littlefs.

    port: one of PORTS.
    mpy: the board's value of sys.implementation._mpy.
    count: number of flash blocks.
    """

    def __init__(self, port: str = "rp2", mpy: int = firmware_files.PICO, count: int = 352) -> None:
        self._context = _Flash(BLOCK * count)
        program, cache = PORTS[port]
        self._layout: dict[str, Any] = {
            "block_size": BLOCK,
            "block_count": count,
            "read_size": 32,
            "prog_size": program,
            "cache_size": cache,
            "lookahead_size": 32,
            "block_cycles": 100,
        }
        self.system = LittleFS(self._context, **self._layout)
        self._written: list[Any] = []
        super().__init__(Path("/no/such/directory"), mpy=mpy)

    def power_cycle(self) -> None:
        """Restart the board. Files that were not closed are lost."""
        context = _Flash(len(self._context.buffer))
        context.buffer[:] = self._context.buffer
        for file in self._written:
            file.close()  # close() writes only to the old buffer
        self._written.clear()
        self._context = context
        self.system = LittleFS(context, mount=False, **self._layout)
        self.system.mount()
        self.modules["os"] = self._os()

    @property
    def free(self) -> int:
        """Return the number of free blocks."""
        return self.system.block_count - self.system.used_block_count

    def put(self, files: dict[str, bytes]) -> None:
        for path, data in files.items():
            self.system.makedirs(path.rpartition("/")[0] or "/", exist_ok=True)
            with self.system.open(path, "wb") as file:
                file.write(data)

    def fill(self, path: str, free: int) -> None:
        """Leave `free` blocks free by writing one large file in an existing folder."""
        self.put({path: b"1" * (BLOCK // 2)})
        count = self.free + 1 - free
        # Each block but the first begins with pointers to earlier blocks.
        self.put({path: bytes(BLOCK * count - 4 * (2 * (count - 1) - (count - 1).bit_count()))})
        assert self.free == free

    def files(self) -> dict[str, bytes]:
        """Return the path and content of every file on the board."""
        contents = {}
        for folder, _, names in self.system.walk("/"):
            for name in names:
                path = f"{folder.rstrip('/')}/{name}"
                with self.system.open(path, "rb") as file:
                    contents[path] = file.read()
        return contents

    def folders(self) -> set[str]:
        return {f"{folder.rstrip('/')}/{name}" for folder, names, _ in self.system.walk("/") for name in names}

    def _open(self, path: str, mode: str = "r") -> Any:
        with _as_os_errors():
            if "w" not in mode:
                return self.system.open(path, mode, buffering=0)
            self.before_change()
            self._written.append(self.system.open(path, mode, buffering=0))
            return _Writer(self, self._written[-1])

    def _os(self) -> types.SimpleNamespace:
        system = self.system

        def ilistdir(path: str) -> list[tuple[str, int, int, int]]:
            return [(e.name, 0x4000 if e.type == 2 else 0x8000, 0, e.size) for e in system.scandir(path)]

        def stat(path: str) -> tuple[int, ...]:
            with _as_os_errors():
                status = system.stat(path)
            return (0x4000 if status.type == 2 else 0x8000, 0, 0, 0, 0, 0, status.size, 0, 0, 0)

        def change(name: str) -> Any:
            def act(*paths: str) -> None:
                self.before_change()
                with _as_os_errors():
                    getattr(system, name)(*paths)

            return act

        return types.SimpleNamespace(
            ilistdir=ilistdir,
            stat=stat,
            mkdir=change("mkdir"),
            remove=change("remove"),
            rmdir=change("rmdir"),
            rename=change("rename"),
            statvfs=lambda _path: (BLOCK, BLOCK, system.block_count, self.free, self.free, 0, 0, 0, 0, 255),
        )


class _Writer:
    """A file that is open for writing."""

    def __init__(self, board: LittlefsBoard, file: Any) -> None:
        self._board, self._file = board, file

    def write(self, data: bytes) -> int:
        self._board.before_change()
        with _as_os_errors():
            return self._file.write(data)

    def close(self) -> None:
        self._board.before_change()
        with _as_os_errors():
            self._file.close()


@contextlib.contextmanager
def _as_os_errors() -> Iterator[None]:
    try:
        yield
    except FileNotFoundError as error:
        raise OSError(errno.ENOENT, "no such file") from error
    except LittleFSError as error:
        raise OSError(-error.code, errno.errorcode[-error.code]) from error
