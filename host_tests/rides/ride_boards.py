"""Boards with rides in flash or with a stream of readings, for the tests of `pull` and `record`."""

import signal
import time
import types

from kickstand.rides import ride_files
from support import fake_board
from support.recordings import ride_writer
from support.web.raw_prompt import streamed


class RideBoard(fake_board.FakeBoard):
    """A board with the firmware and a directory of rides."""

    def __init__(self, root):
        super().__init__(root)
        root.mkdir(exist_ok=True)
        self.settings = types.SimpleNamespace(VEHICLE="motorcycle", SD_SPI=None)
        self.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: self.settings))
        self.modules["kickstand.rides"] = types.SimpleNamespace(ride_files=ride_files)

    def plug_in(self, monkeypatch):
        monkeypatch.setattr("os.ilistdir", self.modules["os"].ilistdir, raising=False)
        return fake_board.plug_in(monkeypatch, self)

    def put(self, name, blocks):
        path = self.root / "rides" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"".join(blocks))

    def paths(self):
        """Return all paths in the board's directory of rides."""
        return sorted(path.relative_to(self.root / "rides").as_posix() for path in self.root.glob("rides/**/*"))


class Clocks:
    """The computer's clocks. Only waiting takes time. While the computer sleeps, its monotonic clock stops."""

    now_s = asleep_s = 0.0

    @classmethod
    def monotonic(cls):
        return cls.now_s

    @classmethod
    def time(cls):
        return cls.now_s + cls.asleep_s

    @classmethod
    def sleep(cls, seconds):
        cls.now_s += seconds


class Stream(fake_board.Serial):
    """A serial port with the output of a board that streams a ride.

    blocks: the blocks of the ride. first: the output before them.
    end: the event after the blocks: "ctrl-c" or another signal, bytes, an exception, or the seconds for which the
        computer sleeps.
    last: the board's output after Ctrl-C.
    """

    def __init__(self, blocks, end=None, last=b"", first=b""):
        super().__init__()
        self.data, self.last = first + b"".join(map(streamed, blocks)), last
        self.end = signal.SIGINT if end == "ctrl-c" else end

    def inWaiting(self):
        if not self.data and self.end is not None:
            end, self.end = self.end, None
            if isinstance(end, signal.Signals):
                signal.raise_signal(end)
            elif isinstance(end, bytes):
                self.data = end
            elif isinstance(end, float):
                Clocks.asleep_s = end
            else:
                raise end
        return len(self.data)

    def write(self, data):
        super().write(data)
        if data == b"\x03":
            self.data += self.last + b"\x04\x04>"


class Streaming(fake_board.FakeBoard):
    """A board whose app runs until its stream ends. Set `serial` to a Stream."""

    def exec_raw_no_follow(self, command):
        self.resets += "machine.reset()" in command


def plug_in(monkeypatch, root, stream):
    """Connect a board with this stream, and replace the computer's clocks. Returns the board."""
    board = Streaming(root)
    board.serial = stream
    Clocks.now_s = Clocks.asleep_s = 0.0
    for name in ("monotonic", "time", "sleep"):
        monkeypatch.setattr(time, name, getattr(Clocks, name))
    return fake_board.plug_in(monkeypatch, board)


def half_seconds(count, **more):
    return ride_writer.blocks(count, length=lambda _: 512, **more)
