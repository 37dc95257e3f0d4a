"""The part of GDB's remote protocol that loads and runs code in QEMU (GDB's manual, "Remote Serial Protocol")."""

import contextlib
import shutil
import socket
import struct
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

STUCK_S = 120  # a call takes milliseconds; after this the code is taken to run for ever
PART = 1024  # bytes of memory in one packet: QEMU takes packets of up to 4096 characters


class Target:
    """A stopped processor at the other end of a socket. Raises TimeoutError where it does not stop again."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._received = b""

    def _answer(self) -> str:
        """The next packet, $text#xx. The checksum is not looked at: the socket does not change anything."""
        while (end := self._received.find(b"#")) < 0 or len(self._received) < end + 3:
            more = self._connection.recv(65536)
            if not more:
                raise ConnectionError("QEMU has ended")
            self._received += more
        text = self._received[self._received.index(b"$") + 1 : end].decode("latin-1")
        self._received = self._received[end + 3 :]
        self._connection.sendall(b"+")
        while (star := text.find("*")) > 0:  # a run of one character: how many more there are, plus 29
            text = text[:star] + text[star - 1] * (ord(text[star + 1]) - 29) + text[star + 2 :]
        return text

    def ask(self, packet: str) -> str:
        """The answer to a packet. Raises ValueError where the target reports an error or does not know it."""
        self._connection.sendall(f"${packet}#{sum(packet.encode()) % 256:02x}".encode())
        answer = self._answer()
        if not answer or answer[0] == "E":
            raise ValueError(f"{packet[:20]}: {answer or 'unknown to the target'}")
        return answer

    def read(self, address: int, length: int) -> bytes:
        data = b""
        while len(data) < length:
            data += bytes.fromhex(self.ask(f"m{address + len(data):x},{min(PART, length - len(data)):x}"))
        return data

    def write(self, address: int, data: bytes) -> None:
        for start in range(0, len(data), PART):
            part = data[start : start + PART]
            self.ask(f"M{address + start:x},{len(part):x}:{part.hex()}")

    def registers(self) -> list[int]:
        """All of them in the target's order, as 32-bit words."""
        words = self.ask("g")
        return list(struct.unpack(f"<{len(words) // 8}I", bytes.fromhex(words)))

    def set_registers(self, words: list[int]) -> None:
        self.ask("G" + struct.pack(f"<{len(words)}I", *words).hex())

    def stop_at(self, address: int) -> None:
        """A breakpoint, which the code in memory does not show."""
        self.ask(f"Z1,{address:x},2")

    def go_on(self) -> None:
        """Run until the next breakpoint."""
        self.ask("c")


@contextlib.contextmanager
def qemu(*command: str) -> Iterator[Target]:
    """QEMU with a processor that waits before its first instruction."""
    if not shutil.which(command[0]):
        raise FileNotFoundError(f"{command[0]} is not installed (Debian: qemu-system-misc)")
    with tempfile.TemporaryDirectory() as directory:
        path = str(Path(directory) / "gdb")
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(path)
            listening.listen(1)
            listening.settimeout(STUCK_S)
            gdb = ["-chardev", f"socket,id=gdb,path={path}", "-gdb", "chardev:gdb"]
            process = subprocess.Popen(
                [*command, "-nographic", "-monitor", "none", "-serial", "none", "-S", *gdb],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
            )
            try:
                connection = listening.accept()[0]
                connection.settimeout(STUCK_S)
                yield Target(connection)
            finally:
                process.kill()
                process.wait()
