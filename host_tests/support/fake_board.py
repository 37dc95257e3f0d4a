"""A fake board for mpremote's own file commands: their scripts run on the host, on a directory instead of a flash."""

import builtins
import contextlib
import errno
import io
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from kickstand_tools.deploy import connection
from kickstand_tools.deploy.firmware_files import PICO
from mpremote.transport import Transport, TransportError, TransportExecError
from serial.tools import list_ports

from support import earlier_names

earlier_names.install()

PICO_PORT = types.SimpleNamespace(device="/dev/ttyACM0", vid=0x2E8A, pid=0x0005)


def plug_in(monkeypatch: pytest.MonkeyPatch, board: Any) -> Any:
    """Make this board the only connected one and let it restart at once. Returns the board."""
    monkeypatch.setattr(list_ports, "comports", lambda: [PICO_PORT])
    monkeypatch.setattr(connection, "ConnectedBoard", lambda name, timeout: board)
    monkeypatch.setattr(connection, "RESTART_S", 0)
    return board


class FakeBoard(Transport):
    """Replaces mpremote's SerialTransport.

    root: the directory that simulates the flash.
    mpy, version, platform: values of sys.implementation._mpy, sys.implementation.version and sys.platform.
    written: paths in the order in which they were opened for writing. A renamed file has its new name.
    on_write(path, data): called before each write. on_write() returns the bytes that are really written.
    before_change(): called before each change of the flash.
    """

    def __init__(
        self,
        root: Path,
        python: str = "micropython",
        answers: bool = True,
        mpy: int = PICO,
        version: tuple = (1, 26, 1, ""),
        platform: str = "rp2",
    ) -> None:
        self.root = root
        self.answers = answers
        self.free_blocks = 300
        self.written: list[str] = []
        self.resets = 0
        self.serial = Serial()
        self.closed = False
        self.on_write: Callable[[str, bytes], bytes] = lambda _path, data: data
        self.before_change: Callable[[], None] = lambda: None
        self.modules: dict[str, Any] = {
            "os": self._os(),
            "sys": types.SimpleNamespace(implementation=_implementation(python, mpy, version), platform=platform),
        }

        def imports(name: str, *rest: Any) -> Any:
            if name in self.modules:
                return self.modules[name]
            if name == "kickstand":
                return self._kickstand()
            if name.startswith("kickstand."):  # never import the firmware that is installed on the host
                raise ImportError(f"no module named '{name}'")
            return __import__(name, *rest)

        self._globals = {"__builtins__": vars(builtins) | {"__import__": imports, "open": self._open}}

    def wait(self, seconds: float) -> None:
        """Wait by the clock of the tools, which a test may replace."""
        connection.time.sleep(seconds)

    def enter_raw_repl(self, soft_reset: bool = True, timeout_overall: int = 10) -> None:
        if not self.answers:
            print(b"\x00\x00")  # mpremote expects these bytes
            raise TransportError("could not enter raw repl")

    def exec(self, command: str | bytes, data_consumer: Callable[[bytes], object] | None = None) -> bytes:
        out = io.StringIO()
        try:
            with contextlib.redirect_stdout(out):
                exec(command, self._globals)
        except ConnectionError:
            raise  # raised if the cable failed, not the board
        except OSError as error:
            number = error.errno or 0
            text = f"OSError: [Errno {number}] {errno.errorcode[number]}"
            raise TransportExecError(b"", f"Traceback\r\n{text}\r\n") from None
        except Exception as error:
            raise TransportExecError(b"", f"Traceback\r\n{type(error).__name__}: {error}\r\n") from None
        data = out.getvalue().encode()
        if data_consumer:
            data_consumer(data)
        return data

    def exec_raw(self, command: str, timeout: float = 10) -> tuple[bytes, bytes]:
        try:
            return self.exec(command), b""
        except TransportExecError as error:
            return b"", error.error_output.encode()

    def eval(self, expression: str) -> Any:
        return eval(self.exec(f"print(repr({expression}))"))

    def exec_raw_no_follow(self, command: str) -> None:
        if "machine.reset()" in command:
            self.resets += 1
            return
        output, error = self.exec_raw(command)
        self.serial.data += output + b"\x04" + error + b"\x04>"

    def close(self) -> None:
        self.closed = True

    def path(self, path: str) -> Path:
        return self.root / path.lstrip("/")

    def _open(self, path: str, mode: str = "r") -> Any:
        if "w" not in mode:
            return open(self.path(path), mode)
        self.before_change()
        self.written.append(path)
        return _Writer(self, path)

    def _os(self) -> types.SimpleNamespace:
        def ilistdir(path: str) -> list[tuple[str, int, int, int]]:
            entries = self.path(path).iterdir()
            return [(p.name, 0x4000, 0, 0) if p.is_dir() else (p.name, 0x8000, 0, p.stat().st_size) for p in entries]

        def stat(path: str) -> tuple[int, ...]:
            status = self.path(path).stat()
            return (0x4000 if self.path(path).is_dir() else 0x8000, 0, 0, 0, 0, 0, status.st_size, 0, 0, 0)

        def change(function: Callable[..., Any], *arguments: Any) -> None:
            self.before_change()
            function(*arguments)

        def rename(old: str, new: str) -> None:
            self.path(old).rename(self.path(new))
            if old in self.written:
                self.written.remove(old)
                self.written.append(new)

        return types.SimpleNamespace(
            ilistdir=ilistdir,
            listdir=lambda path: [p.name for p in self.path(path).iterdir()],
            stat=stat,
            mkdir=lambda path: change(self.path(path).mkdir),
            remove=lambda path: change(self.path(path).unlink),
            rename=lambda old, new: change(rename, old, new),
            rmdir=lambda path: change(self.path(path).rmdir),
            statvfs=lambda _path: (4096, 4096, 350, self.free_blocks, self.free_blocks, 0, 0, 0, 0, 255),
        )

    def _kickstand(self) -> types.ModuleType:
        if not self.path("kickstand/__init__.py").exists():
            raise ImportError("no module named 'kickstand'")
        module = types.ModuleType("kickstand")
        exec(self.path("kickstand/__init__.py").read_text(), vars(module))
        return module


class Serial:
    """Replaces the serial port: holds the data to be read and the data written."""

    def __init__(self) -> None:
        self.data = b""
        self.written = b""

    def inWaiting(self) -> int:
        return len(self.data)

    def read(self, count: int) -> bytes:
        count = min(count, 700)
        piece, self.data = self.data[:count], self.data[count:]
        return piece

    def write(self, data: bytes) -> None:
        self.written += data


class _Writer:
    def __init__(self, board: FakeBoard, path: str) -> None:
        self._board, self._path = board, path
        self._file = open(board.path(path), "wb")

    def write(self, data: bytes) -> int:
        self._board.before_change()
        return self._file.write(self._board.on_write(self._path, data))

    def close(self) -> None:
        self._file.close()

    __del__ = close  # as on a board, whose soft reset closes its files


def _implementation(name: str, mpy: int, version: tuple) -> types.SimpleNamespace:
    return types.SimpleNamespace(name=name, version=version, _machine="Imagined Pico with RP2040", _mpy=mpy)


def files(root: Path) -> dict[str, bytes]:
    """Return {path on the board: content} of all files on it."""
    return {"/" + p.relative_to(root).as_posix(): p.read_bytes() for p in root.rglob("*") if p.is_file()}
