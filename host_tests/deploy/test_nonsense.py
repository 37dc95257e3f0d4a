"""A board may send nonsense. Each command then prints one line and writes no file outside its folder."""

import binascii
import contextlib

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import connection
from kickstand_tools.rides.block_reader import BadBlock, parse, read
from mpremote.transport import TransportError
from support import command, fake_board
from support.recordings import broken_logs, ride_writer

NONSENSE = {
    "nothing": b"",
    "bytes": bytes(range(256)),
    "no UTF-8": b"\xff\xfe\xfd\n",
    "half a line": b"('rp2', ",
    "another language": b"$GPRMC,120000.00,A,4807.038,N*00\r\n" * 3,
    "numbers": b"1\n2\n3\n",
    "deep": b"(" * 5000,
    "long number": b"9" * 5000,
    "a call": b"__import__('os')\n",
    "negative": b"('/rides', 'car')\n(-1, -1, -1, '/rides/x')\n",
    "a path for a number": b"('/rides', 'car')\n('../../../OWNED', 0, 5, '/rides/x')\n",
    "half a ride": b"('/rides', 'car')\n(1.5, 0, 5, '/rides/x')\n",
    "a file elsewhere": b"('/rides', 'car')\n(1, 0, 5, '/config.py')\n",
    "wrong types": b"(1, 2)\n({}, [], None, 0)\n",
    "lists": b"[]\n[]\n",
    "nul": b"\0" * 100,
}
COMMANDS = {
    "flash": ("flash",),
    "status": ("status",),
    "check": ("check",),
    "pull": ("pull", "--out", "out"),
    "record": ("record", "--out", "RIDE.csv"),
}


class Nonsense(fake_board.FakeBoard):
    """A board that answers every command with the same bytes. first: number of correct answers before the nonsense."""

    def __init__(self, root, content, first=0):
        super().__init__(root)
        self._content, self._first = content, first

    def exec(self, command, data_consumer=None):
        if self._first > 0:
            self._first -= 1
            return super().exec(command, data_consumer)
        return self._content

    def exec_raw_no_follow(self, command):
        self.serial.data += self._content + b"\x04\x04>"


@pytest.fixture
def plug_in(tmp_path, monkeypatch):
    """Return a function that makes its argument the only connected board."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flash").mkdir()
    (tmp_path / "out").mkdir()
    return lambda board: fake_board.plug_in(monkeypatch, board)


def one_line(result):
    assert "Traceback" not in result.err
    assert "fault in kickstand" not in result.err
    assert "unexpected" not in result.err
    if result.status:
        assert result.status == 2
        assert result.err.count("\n") == 1


@pytest.mark.parametrize("content", NONSENSE.values(), ids=NONSENSE)
@pytest.mark.parametrize("name", COMMANDS)
def test_invalid_answer_gives_one_line_and_no_file(tmp_path, plug_in, name, content):
    for first in (0, 1, 3):
        plug_in(Nonsense(tmp_path / "flash", content, first))
        one_line(command.run(*COMMANDS[name]))
        assert sorted(path.name for path in tmp_path.iterdir()) == ["flash", "out"]
        assert not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("name", COMMANDS)
def test_mutated_answer_gives_one_line(tmp_path, plug_in, name):
    good = b"('/rides', 'motorcycle')\n(1, 0, 700, '/rides/000/01/00000.rid')\n('micropython', '1.26.1', 'Pico')\n"
    for number in range(30):
        plug_in(Nonsense(tmp_path / "flash", broken_logs.broken([good], number)[1], number % 3))
        one_line(command.run(*COMMANDS[name]))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flash", "out"]


class Endless:
    """A serial port that sends the same bytes for ever."""

    def __init__(self, said):
        self._said, self.count = said, 0

    def inWaiting(self):
        return 1

    def read(self, count=1):
        self.count += count
        return self._said


@pytest.mark.parametrize("ending", [b"\x04", b"raw REPL; CTRL-B to exit\r\n>"])
@pytest.mark.parametrize("said", [b"x", b"\n", b">"])
def test_endless_answer_is_abandoned(monkeypatch, ending, said):
    monkeypatch.setattr(connection, "MOST_BYTES", 5000)
    board = connection.ConnectedBoard.__new__(connection.ConnectedBoard)
    board.serial = Endless(said)
    board.is_pty = False
    with pytest.raises(TransportError, match="does not end"):
        board.read_until(1, ending)
    assert board.serial.count < 6000


def test_ride_longer_than_announced_is_abandoned(tmp_path, plug_in, monkeypatch):
    listed = b"('/rides', 'car')\n(1, 0, 100, '/rides/000/01/00000.rid')\n"

    class Long(fake_board.FakeBoard):
        def exec_raw(self, command, timeout=10):
            return listed, b""

        def exec_raw_no_follow(self, command):
            self.serial.data += b"AAAA\n" * 100_000

    plug_in(Long(tmp_path / "flash"))
    line = command.refused(tmp_path / "out", "pull", "--out", tmp_path / "out", words="did not arrive completely")
    assert "the program on the board does not end" in line


def test_a_link_in_the_directory_is_not_followed(tmp_path, plug_in):
    blocks = ride_writer.blocks(3, ride=1)[0]
    content = b"".join(blocks)

    class Board(fake_board.FakeBoard):
        def exec_raw(self, command, timeout=10):
            return f"('/rides', 'car')\n(1, 0, {len(content)}, '/rides/1.rid')\n".encode(), b""

        def exec_raw_no_follow(self, command):
            if "open(" in command:
                self.serial.data += binascii.b2a_base64(content) + b"\x04\x04>"

    plug_in(Board(tmp_path / "flash"))
    command.works("pull", "--out", tmp_path / "out")
    (log,) = (tmp_path / "out").glob("*.csv.gz")
    log.unlink()
    log.symlink_to(tmp_path / "elsewhere.csv.gz")
    plug_in(Board(tmp_path / "flash"))
    result = command.run("pull", "--out", tmp_path / "out")
    assert result.status == 2 and "is a link to" in result.err
    assert not (tmp_path / "elsewhere.csv.gz").exists()


def test_a_mutated_ride_gives_blocks_or_problems():
    blocks = ride_writer.blocks(6, ride=1)[0]
    content = b"".join(blocks)
    for number in range(150):
        mutated = broken_logs.broken([content], number)[1]
        found, problems = read(mutated)
        assert found or problems or not mutated
        with contextlib.suppress(BadBlock):
            parse(broken_logs.broken([blocks[0]], number)[1])


def test_valid_answers_are_accepted():
    for text, shape in ((b"(1, 'a')\r\n", (int, str)), (b"('x', None)", (str, None))):
        connection.literal(text, shape)
    others = (b"(1, 'a')", (int, int)), (b"(True, 'a')", (int, str)), (b"(-1, 'a')", (int, str))
    for text, shape in (*others, (b"1.0", int), (b"print()", str)):
        with pytest.raises(InputError, match="makes no sense"):
            connection.literal(text, shape)
