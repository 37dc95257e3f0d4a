"""A serial port with a board at its raw prompt, and the clock of the computer."""

from typing import Any

BANNER = b"raw REPL; CTRL-B to exit\r\n>"


class SerialPort:
    """A port as pyserial opens it.

    answers: the board's answers to the programs; the last one is repeated. An answer is (output, error), or a list of
        pieces of output. In the list a number is a pause in s, a tuple a sleep of the computer in s, and an exception
        the end of the connection.
    chatter: what the board sends again and again instead of its prompt. None means that it has a prompt.
    deaf: how many requests for the prompt the board ignores.
    refusal: the error that opening the port raises until ready_s, or None.
    programs, controls: the programs and the control characters that were sent.
    """

    dtr = rts = True

    def __init__(self) -> None:
        self.answers: list[tuple[bytes, bytes] | list[Any]] = [(b"", b"")]
        self.chatter: bytes | None = None
        self.deaf = 0
        self.refusal: Exception | None = None
        self.ready_s = 1e9
        self.programs: list[bytes] = []
        self.controls = b""
        self.opened: list[tuple[str, float]] = []
        self.closed = 0
        self.now_s = self.asleep_s = 0.0
        self._chatted_s = -1.0
        self._waiting, self._typed = b"", b""
        self._pieces: list[Any] = []

    def open(self, name: str, timeout: float = 0, **_options: Any) -> "SerialPort":
        self.opened.append((name, timeout))
        if self.refusal and self.now_s < self.ready_s:
            raise self.refusal
        return self

    def monotonic(self) -> float:
        return self.now_s

    def time(self) -> float:
        return self.now_s + self.asleep_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds
        if self._pieces and isinstance(self._pieces[0], float):
            self._pieces[0] -= seconds

    def isOpen(self) -> bool:
        return True

    def close(self) -> None:
        self.closed += 1

    def inWaiting(self) -> int:
        if self.chatter and not self._waiting and self.now_s > self._chatted_s:
            self._waiting, self._chatted_s = self.chatter, self.now_s
        while self._pieces and not self._waiting:
            piece = self._pieces[0]
            if isinstance(piece, float) and piece > 0.0:
                break
            self._pieces.pop(0)
            if isinstance(piece, Exception):
                raise piece
            if isinstance(piece, tuple):
                self.asleep_s += piece[0]
            elif isinstance(piece, bytes):
                self._waiting = piece
        return len(self._waiting)

    def read(self, count: int = 1) -> bytes:
        self.inWaiting()
        piece, self._waiting = self._waiting[:count], self._waiting[count:]
        return piece

    def write(self, data: bytes) -> None:
        if data in (b"\x03", b"\x01"):
            self.controls += data
        elif self.chatter is not None or data == b"\r\x03":
            return
        elif data == b"\r\x01":
            self.deaf -= 1
            self._waiting += BANNER if self.deaf < 0 else b""
        elif data == b"\x05A\x01":
            self._waiting += b"R\x00"  # this board has no raw paste mode
        elif data != b"\x04":
            self._typed += data
        elif not self._typed:
            self._waiting += b"OK\r\nMPY: soft reboot\r\n" + BANNER
        else:
            self.programs.append(self._typed)
            self._typed, self._waiting = b"", b"OK"
            answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
            if isinstance(answer, list):
                self._pieces = list(answer)
            else:
                self._waiting += b"%b\x04%b\x04>" % answer
