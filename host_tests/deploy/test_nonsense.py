"""A board may send nonsense. Each command then prints one line and writes no file outside its folder."""

import pytest
from support import command, fake_board

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
    "a ride without end": b"('/rides', 'car')\n(100000, 0, 5, '/rides/x')\n",
    "a file elsewhere": b"('/rides', 'car')\n(1, 0, 5, '/config.py')\n",
    "wrong types": b"(1, 2)\n({}, [], None, 0)\n",
    "lists": b"[]\n[]\n",
    "nul": b"\0" * 100,
}
COMMANDS = (["flash"], ["status"], ["check"], ["pull", "--out", "out"], ["record", "--out", "RIDE.csv"])


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
def folder(tmp_path, monkeypatch):
    """Return the current folder. The board's flash and the folder of the rides are in it, and are empty."""
    monkeypatch.chdir(tmp_path)
    for name in ("flash", "out"):
        (tmp_path / name).mkdir()
    return tmp_path


def refused_in_one_line(monkeypatch, folder, arguments, content, first):
    fake_board.plug_in(monkeypatch, Nonsense(folder / "flash", content, first))
    result = command.run(*arguments)
    for words in ("Traceback", "fault in kickstand", "unexpected"):
        assert words not in result.err
    assert not result.status or (result.status == 2 and result.err.count("\n") == 1)
    assert sorted(path.name for path in folder.rglob("*")) == ["flash", "out"]


@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda arguments: arguments[0])
def test_invalid_answer_gives_one_line_and_no_file(folder, monkeypatch, arguments):
    for content in NONSENSE.values():
        for first in (0, 1, 3):
            refused_in_one_line(monkeypatch, folder, arguments, content, first)
