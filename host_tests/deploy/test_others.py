"""A used board may contain files of other projects. `flash` renames and keeps these files. A config.py that would stop
the firmware is refused."""

import sys

import pytest
from kickstand_tools.common import firmware_path
from kickstand_tools.deploy import others
from support import command, fake_board

WEATHER = b"# my weather station\nimport machine\nwhile True: pass\n"
WIFI = b'SSID = "home"\nPASSWORD = "secret"\n'
FACTORY_BOOT = b"# This file is executed on every boot (including wake-boot from deepsleep)\n#import esp\n"
MARK = b"\xef\xbb\xbf"
SHIPPED = (firmware_path.directory() / "config.py").read_bytes()
MAIN = (firmware_path.directory() / "main.py").read_bytes()


@pytest.fixture
def board(tmp_path, monkeypatch):
    (tmp_path / "flash").mkdir()
    return fake_board.plug_in(monkeypatch, fake_board.FakeBoard(tmp_path / "flash"))


def put(board, **files):
    for name, content in files.items():
        board.path(f"{name}.py").write_bytes(content)


def own(board):
    """Return the files in the board's root, without MicroPython's own."""
    return {path.name: path.read_bytes() for path in board.root.iterdir() if path.is_file()}


@pytest.mark.parametrize(
    ("there", "kept"),
    [
        ({"main": WEATHER}, ["main"]),
        ({"main": b"from kickstand.start import main\nimport mine\nmain()\n"}, ["main"]),
        ({"main": b"\xff\xfe\0binary"}, ["main"]),
        ({"boot": b"import webrepl\nwebrepl.start()\n"}, ["boot"]),
        ({"boot": FACTORY_BOOT}, []),
        ({"config": WIFI}, ["config"]),
        ({"config": b"ssid = 'home'\n"}, ["config"]),
        ({"config": b"DISPLAY = 'ST7789'\nPASSWORD = 'x'\n"}, ["config"]),
        ({"config": "WLAN = 'Caf\xe9'".encode("latin-1")}, ["config"]),
        ({"main": WEATHER, "boot": b"import x\n", "config": WIFI}, ["main", "boot", "config"]),
        ({"main": MAIN}, []),
        ({"main": MAIN.replace(b"\n", b"\r\n")}, []),
        ({"config": b'SIDE = "right"\n'}, []),
    ],
)
def test_other_projects_files_are_renamed(there, kept, board):
    put(board, **there)
    result = command.works("flash", "--yes")
    now = own(board)
    for name in kept:
        assert now[f"{name}-before-kickstand.py"] == there[name]
        assert f"kept: {name}.py on the board is another project's" in result.out
    assert result.out.count("another project's") == len(kept)
    assert now["main.py"] == MAIN
    for name in there.keys() - {"main", *kept}:
        assert now[f"{name}.py"] == there[name]
    assert command.works("flash").out.count("another project's") == 0  # the second run moves no file again
    assert own(board) == now


def test_nothing_changes_without_yes(board, monkeypatch):
    put(board, main=WEATHER, config=WIFI)
    said = command.refused(board.root, "flash", words="kept as main-before-kickstand.py")
    assert "config-before-kickstand.py: run kickstand flash --yes for that" in said
    assert board.resets == 1
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.confirm", lambda *_args, **_more: True)
    command.works("flash")
    assert own(board)["main-before-kickstand.py"] == WEATHER


def test_used_name_is_not_overwritten(board):
    put(board, main=WEATHER)
    board.path("main-before-kickstand.py").write_bytes(b"an earlier one")
    command.works("flash", "--yes")
    assert own(board)["main-before-kickstand.py"] == b"an earlier one"
    assert own(board)["main-before-kickstand-2.py"] == WEATHER


@pytest.mark.parametrize(
    ("config", "words"),
    [
        (b"SIDE = 'up'\n", "config.py on the board, line 1"),
        (b"SIDE = 'left'\nPASSWORD = 'x'\n", "PASSWORD"),
        (b"SIDE = \xe2\x80\x9cleft\xe2\x80\x9d\n", "SyntaxError"),
        ("SIDE = 'left'  # c\xf4t\xe9\n".encode("latin-1"), "not text in UTF-8"),
        (b"import pathlib\nSIDE = 'left'\n", "MicroPython has no module pathlib"),
        (b"SIDE = 'left'\nmatch 1:\n    case 1: pass\n", "MicroPython does not take it"),
    ],
)
def test_boards_own_config_is_checked_before_any_change(config, words, board):
    command.works("flash")
    put(board, config=config)
    said = command.refused(board.root, "flash", words=words)
    assert "kickstand flash --config" in said
    command.works("flash", "--config")
    assert own(board)["config.py"] == SHIPPED


@pytest.mark.parametrize("content", [b'SIDE = "right"\r\n', SHIPPED])
@pytest.mark.parametrize("encode", [lambda text: MARK + text, lambda text: text.decode().encode("utf-16")])
def test_byte_order_mark_is_never_copied(encode, content, board, tmp_path, monkeypatch):
    (tmp_path / "mine" / "firmware" / "kickstand").mkdir(parents=True)
    (tmp_path / "mine" / "firmware" / "config.py").write_bytes(encode(content))
    monkeypatch.chdir(tmp_path / "mine")
    command.works("flash", "--config")
    assert own(board)["config.py"] == content
    put(board, config=encode(content))  # correct the config.py on the board
    command.works("flash")
    assert own(board)["config.py"] == content


def test_every_earlier_main_of_kickstand_is_recognised():
    assert len(others._OWN_MAIN) >= 13
    assert others._is_own_main(MAIN)


def test_a_byte_lost_on_the_cable_is_sent_again(board):
    lost = iter([True, False, False])
    board.on_write = lambda path, data: data[:-1] if path.endswith("store.mpy") and next(lost, False) else data
    command.works("flash")
    assert own(board)["main.py"] == MAIN
