"""`kickstand flash` on a fake board: what is copied, kept and renamed, and which faults stop it."""

import errno
import functools
import re
import sys
from typing import Any

import pytest
from kickstand_tools.common import installation
from kickstand_tools.deploy import firmware_files
from support import command, fake_board
from support.watched_stderr import Watched

WEATHER = b"# my weather station\nimport machine\nwhile True: pass\n"
WIFI = b'SSID = "home"\nPASSWORD = "secret"\n'
MAIN = (installation.firmware() / "main.py").read_bytes()
BOOT = {"/boot.py": b"# boot\n"}


@functools.cache
def wanted(mpy=firmware_files.PICO):
    return firmware_files.contents(mpy)


def put(board, files):
    for name, content in files.items():
        path = board.path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def root_files(board):
    return {path.name: path.read_bytes() for path in board.root.iterdir() if path.is_file()}


# The firmware's files


def test_empty_board_gets_everything_and_starts(board):
    result = command.works("flash")
    assert fake_board.files(board.root) == wanted() | BOOT
    assert board.written[-1] == "/main.py"  # main.py is written last, so an old main.py never runs with new modules
    assert (board.resets, board.closed) == (1, True)
    size = sum(map(len, wanted().values())) / 1000
    assert result.err == "" and result.out == (
        "Imagined Pico with RP2040, MicroPython 1.26.1 on /dev/ttyACM0\n"
        f"config.py is {installation.config()}\n"
        f"copied {len(wanted())} files, {size:.1f} kB, and verified them; 0 left as they were\n"
        "restarted: the display shows the rest\n"
    )


@pytest.mark.parametrize("change", [lambda old: old[:-1] + b"#", lambda old: b""])
def test_only_different_files_are_copied(board, change):
    command.works("flash")
    board.written.clear()
    assert "copied 0 files" in command.works("flash").out and board.written == []
    path = board.path("kickstand/lean/kalman.mpy")
    path.write_bytes(change(path.read_bytes()))
    command.works("flash")
    assert board.written == ["/kickstand/lean/kalman.mpy", "/main.py"]
    assert path.read_bytes() == wanted()["/kickstand/lean/kalman.mpy"]


@pytest.mark.parametrize(
    ("mpy", "reason"),
    [(0x1305, "another format"), (0x1206, "another format"), (0x0306, "does not accept compiled files")],
)
def test_board_with_other_bytecode_gets_the_sources(board, monkeypatch, mpy, reason):
    command.works("flash")
    fake_board.plug_in(monkeypatch, fake_board.FakeBoard(board.root, mpy=mpy))
    result = command.works("flash")
    assert fake_board.files(board.root) == wanted(None) | BOOT
    assert re.search(f"note: .*{reason}.*: the board gets the sources and starts more slowly", result.out)


def test_byte_lost_on_the_cable_is_sent_again(board):
    losses = iter([True, False, False])
    board.on_write = lambda path, data: data[:-1] if path.endswith("store.mpy") and next(losses, False) else data
    command.works("flash")
    assert fake_board.files(board.root) == wanted() | BOOT


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (b"?", "kickstand/calibration/store.mpy reads back differently, 3 times: the connection loses bytes"),
        (OSError(errno.ENOSPC, "full"), "is full"),
        (ConnectionError("device disconnected"), "connection lost (device disconnected)"),
    ],
)
def test_fault_while_copying_leaves_no_main(board, fault, message):
    def write(path, data):
        if path != "/kickstand/calibration/store.mpy":
            return data
        if isinstance(fault, bytes):
            return data[:-1] + fault
        raise fault

    board.on_write = write
    result = command.run("flash")
    assert (result.status, result.err.count("\n"), board.closed, board.resets) == (2, 1, True, 0)
    assert message in result.err and not board.path("main.py").exists()


@pytest.mark.parametrize("verb", ["flash", "status", "check"])
def test_device_without_micropython_is_refused(board, monkeypatch, verb):
    fitted: dict[str, Any]
    for fitted, message in (
        ({"python": "circuitpython"}, "runs circuitpython: put MicroPython on the board"),
        ({"answers": False}, "no MicroPython answers on /dev/ttyACM0"),
    ):
        other = fake_board.plug_in(monkeypatch, fake_board.FakeBoard(board.root, **fitted))
        command.refused(board.root, verb, words=message)
        assert other.closed


@pytest.mark.parametrize(
    ("version", "platform", "words"),
    [
        ((1, 22, 2, ""), "rp2", "MicroPython 1.22.2: put MicroPython 1.23 or newer on the board first"),
        ((1, 19, 1), "esp32", "MicroPython 1.19.1: put MicroPython 1.23 or newer on the board first"),
        ((1, 23, 0, "preview"), "rp2", None),
        ((2, 0, 0, ""), "rp2", None),
        ((1, 28, 0, ""), "pyboard", "Kickstand runs on a Raspberry Pi Pico and on an ESP32"),
    ],
)
def test_unsupported_micropython_is_refused(version, platform, words, board, monkeypatch):
    other = fake_board.FakeBoard(board.root, version=version, platform=platform)
    fake_board.plug_in(monkeypatch, other)
    if words:
        command.refused(board.root, "flash", words=words)
    else:
        command.works("flash")


@pytest.mark.parametrize("installed", [False, True])
def test_status_needs_a_firmware_of_this_version(board, installed):
    message = "kickstand flash brings it up to date" if installed else "install it with kickstand flash"
    if installed:
        put(board, {"kickstand/__init__.py": b""})
    command.refused(board.root, "status", words=message)
    assert board.resets == 1


# The rider's files


def test_files_of_the_rider_are_kept(board):
    names = ("kickstand_a.cal", "kickstand/kickstand_a.cal", "kickstand/notes.txt", "lib/x.py", "y.py", "user.py")
    put(board, dict.fromkeys(names, b"mine"))
    command.works("flash", "--config")
    assert [board.path(name).read_bytes() for name in names] == [b"mine"] * len(names)


def test_edited_config_is_kept_unless_requested(board, config):
    command.works("flash")
    put(board, {"config.py": b"# on the board\n"})
    result = command.works("flash")
    assert root_files(board)["config.py"] == b"# on the board\n"
    assert "kept: config.py on the board is not this version's; --config would replace it" in result.out
    assert "config.py is" not in result.out
    assert f"config.py is {config}\n" in command.works("flash", "--config").out
    assert root_files(board)["config.py"] == b'SIDE = "right"\n'


@pytest.mark.parametrize(
    ("files", "renamed"),
    [
        ({"main": WEATHER}, ["main"]),
        ({"main": b"from kickstand.start import main\nimport mine\nmain()\n"}, ["main"]),
        ({"boot": b"import webrepl\nwebrepl.start()\n"}, ["boot"]),
        ({"boot": b"# This file is executed on every boot\n#import esp\n"}, []),
        ({"config": WIFI}, ["config"]),
        ({"config": b"DISPLAY = 'ST7789'\nPASSWORD = 'x'\n"}, ["config"]),
        ({"config": b"DISPLAY = 'auto'\nSIDE = 'left'\n"}, []),
        ({"config": "WLAN = 'Caf\xe9'".encode("latin-1")}, ["config"]),
        ({"main": WEATHER, "boot": b"import x\n", "config": WIFI}, ["main", "boot", "config"]),
        ({"main": MAIN.replace(b"\n", b"\r\n")}, []),
        ({"config": b'SIDE = "right"\n'}, []),
    ],
)
def test_other_projects_files_are_renamed(files, renamed, board):
    put(board, {f"{name}.py": content for name, content in files.items()})
    result = command.works("flash", "--yes")
    new_files = root_files(board)
    for name in renamed:
        assert new_files[f"{name}-before-kickstand.py"] == files[name]
        line = f"kept: {name}.py on the board is another project's: kept as {name}-before-kickstand.py\n"
        assert line in result.out
    assert result.out.count("another project's") == len(renamed) and new_files["main.py"] == MAIN
    for name in files.keys() - {"main", *renamed}:
        assert new_files[f"{name}.py"] == files[name]
    assert "another project's" not in command.works("flash").out and root_files(board) == new_files


@pytest.mark.parametrize(
    ("answer", "words"),
    [("", "run kickstand flash --yes for that"), ("n", "nothing was changed on the board"), ("y", "Install Kickstand")],
)
def test_they_are_renamed_only_after_a_yes(answer, words, board, monkeypatch):
    """Without a terminal nobody can answer."""
    put(board, {"main.py": WEATHER})
    files = root_files(board)
    if answer:
        monkeypatch.setattr(sys, "stdin", Watched(f"{answer}\n"))
    assert words in command.run("flash").err and board.resets == 1
    assert (root_files(board) == files) == (answer != "y")


FAULTS = [
    (b"# one\nSIDE = 'up'\n", "line 2: SIDE = 'up', but it must be one of 'left', 'right'"),
    (b"SIDE = 'left'\nPASSWORD = 'x'\n", "line 2: PASSWORD is not a setting"),
    (b"SIDE = \xe2\x80\x9cleft\xe2\x80\x9d\n", "line 1: SyntaxError"),
    ("SIDE = 'left'  # c\xf4t\xe9\n".encode("latin-1"), "is not text in UTF-8"),
    (b"import pathlib\nSIDE = 'left'\n", "line 1: MicroPython has no module pathlib"),
    (b"SIDE = 'left'\nmatch 1:\n    case 1: pass\n", "MicroPython does not take it"),
]


@pytest.mark.parametrize(("content", "reason"), FAULTS)
def test_faulty_config_stops_flash_before_any_change(content, reason, board, config):
    """This holds for the board's own config.py, and for the checkout's if it would be copied."""
    config.write_bytes(content)
    refusal = command.refused(board.root, "flash", words=reason)
    assert str(config) in refusal and "correct it and run this command again" in refusal and board.resets == 1
    config.write_bytes(b'SIDE = "right"\n')
    command.works("flash")
    put(board, {"config.py": content})
    refusal = command.refused(board.root, "flash", words=reason)
    assert "config.py on the board" in refusal and "kickstand flash --config" in refusal
    command.works("flash", "--config")
    config.write_bytes(content)
    command.works("flash")  # this config.py is not copied
    assert root_files(board)["config.py"] == b'SIDE = "right"\n'


@pytest.mark.parametrize("encode", [lambda text: b"\xef\xbb\xbf" + text, lambda text: text.decode().encode("utf-16")])
def test_byte_order_mark_is_never_copied(encode, board, config):
    content = b'SIDE = "right"\r\n'
    config.write_bytes(encode(content))
    command.works("flash", "--config")
    assert root_files(board)["config.py"] == content
    put(board, {"config.py": encode(content)})
    command.works("flash")
    assert root_files(board)["config.py"] == content
