"""Tests updates of a board with an older version: the files that are removed, an interruption at any step, and the
required space."""

import functools
import hashlib
from pathlib import PurePosixPath
from typing import Any

import pytest
from kickstand.rides import flash_ring
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import bytecode, firmware_files, flash, others, update
from kickstand_tools.deploy.board_files import BoardFiles, fingerprint, survey
from kickstand_tools.deploy.update import needed_blocks, plan, refuse_without_room
from littlefs_board import BLOCK, PORTS, LittlefsBoard
from support import command, fake_board

# The modules of version 0.2.0, which were all in one folder.
FLAT = """
__init__ align_wizard alignment app braking braking_regression bus button calibration capture dispersion drive_mode
driving driving_check driving_events driving_parts driving_published driving_quality driving_reasons errors
force_history frames frames_viper gps hardware hd44780 kalman lean lean_filter menu meter mpu6050 pages port pose
recorder rest ride_file ride_file_viper ride_ring ride_stream rodrigues rotation sample_clock screen sd_card sensor
settings six_position six_wizard speed speed_check standing status_report store transform transform_viper trim wheel
""".split()
FLAT_BYTES = {".mpy": 1800, ".py": 5000}  # size of most files, in bytes
FLAT_SMALL_BYTES = 400  # size in bytes of every sixth file; littlefs may store such a small file inside its folder
NOTES = {"/kickstand/notes.txt": b"mine", "/kickstand_a.cal": b"calibration"}


@functools.cache
def contents(mpy):
    return firmware_files.contents(mpy)


def wanted(ending):
    return contents(bytecode.PICO if ending == ".mpy" else None)


def before(which):
    """Return the files of an older version on a board.

    which: "nothing", or the layout ("flat" or "nested") and the ending of its files, such as "flat .py".
    """
    if which == "nothing":
        return {}
    layout, ending = which.split()
    if layout == "nested":  # in this version every module differs from the new version
        return {path: data[:-1] + b"#" for path, data in wanted(ending).items()}
    modules = {
        f"/kickstand/{name}{ending}": bytes(FLAT_BYTES[ending] if i % 6 else FLAT_SMALL_BYTES)
        for i, name in enumerate(FLAT)
    }
    return modules | {"/main.py": MAIN_THEN, "/config.py": b"# 0.2.0\n" * 700}


MAIN_THEN = b"# 0.2.0\n" * 330


@pytest.fixture
def plugged(monkeypatch):
    """Return a function that makes its argument the only connected board, and returns it."""
    then = MAIN_THEN, before("nested .py")["/main.py"]
    monkeypatch.setattr(others, "_OWN_MAIN", {hashlib.sha256(text).hexdigest()[:16] for text in then})

    def plug(board):
        monkeypatch.setattr(flash, "contents", lambda mpy, _compiler: dict(contents(mpy or None)))
        return fake_board.plug_in(monkeypatch, board)

    return plug


def fresh(port="rp2", ending=".mpy") -> Any:
    """Return an empty board that accepts compiled files, or only .py files."""
    return LittlefsBoard(port, mpy=bytecode.PICO if ending == ".mpy" else 0)


@pytest.mark.parametrize("ending", [".mpy", ".py"])
def test_flat_modules_of_old_versions_are_removed(plugged, ending):
    board = plugged(fresh())
    board.put(before("flat " + ending) | NOTES | {"/kickstand/lean/old/older.py": b"pass", "/kickstand/own/a.txt": b""})
    board.system.makedirs("/kickstand/errors")  # a folder of this name would hide errors.mpy from the import
    result = command.works("flash")
    expected = wanted(".mpy") | NOTES | {"/kickstand/own/a.txt": b"", "/config.py": before("flat .py")["/config.py"]}
    assert board.files() == expected
    folders = {path.rpartition("/")[0] for path in expected} - {""}
    assert board.folders() == folders
    assert "removed: " in result.out
    assert "kept: config.py" in result.out


@pytest.mark.parametrize("name", ["/kickstand/lean", "/kickstand/errors/notes.txt"])
def test_file_in_the_way_is_reported_before_any_change(plugged, name):
    board = plugged(fresh())
    files = before("flat .mpy") | {name: b"mine"}
    board.put(files)
    result = command.run("flash")
    assert result.status == 2
    assert f"{name[1:]} on the board is in the way" in result.err
    assert board.files() == files
    assert board.resets == 1


SMALL_OLD = {
    "/kickstand/__init__.mpy": b"old",
    "/kickstand/errors.mpy": b"same",
    "/kickstand/lean.mpy": b"old" * 500,
    "/kickstand/lean_filter.py": b"old",
    "/kickstand/empty/old.py": b"old",
    "/main.py": b"old",
    "/config.py": b"old",
}
SMALL_NEW = {
    "/kickstand/__init__.mpy": b"new",
    "/kickstand/errors.mpy": b"same",
    "/kickstand/lean/lean_filter.mpy": b"new" * 1000,
    "/kickstand/lean/meter.mpy": b"new",
    "/config.py": b"new" * 1000,
    "/main.py": b"new" * 1000,
}


class Cut(ConnectionError):
    """Raised to simulate that the cable is pulled or the power is cut."""


def cut_at(board, number):
    """Interrupt the work before the change with this number."""
    left = number

    def before_change():
        nonlocal left
        if left == 0:
            raise Cut("device disconnected")
        left -= 1

    board.before_change = before_change


def test_interrupted_update_starts_nothing_and_is_repeatable():
    number = 0
    while True:
        board = fresh()
        board.put(SMALL_OLD | NOTES)
        cut_at(board, number)
        try:
            flash.install(board, flash.prepare(board, SMALL_NEW, replace_config=True))
            break
        except Cut:
            pass
        board.power_cycle()
        found = board.files()
        assert ("/main.py" in found) == (number == 0)
        assert number or found == SMALL_OLD | NOTES
        assert set(NOTES.items()) <= set(found.items())
        board.before_change = lambda: None
        flash.install(board, flash.prepare(board, SMALL_NEW))
        # config.py is complete, and it is kept because this call has no --config
        config = found.get("/config.py", SMALL_NEW["/config.py"])
        assert config in (SMALL_OLD["/config.py"], SMALL_NEW["/config.py"])
        assert board.files() == SMALL_NEW | NOTES | {"/config.py": config}, f"after a cut before change {number}"
        assert board.folders() == {"/kickstand", "/kickstand/lean"}
        number += 1
    assert number > 25
    assert board.files() == SMALL_NEW | NOTES
    assert board.folders() == {"/kickstand", "/kickstand/lean"}


@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("ending", [".mpy", ".py"])
@pytest.mark.parametrize("which", ["nothing", "flat .mpy", "flat .py", "nested .mpy", "nested .py"])
def test_reported_free_space_is_enough(plugged, port, ending, which):
    """With one free block less than reported, the update is refused and changes nothing. If the flash is full of rides,
    the message says what to do."""
    board = plugged(fresh(port, ending))
    board.put(before(which) | {"/rides/000/01/00000.rid": b"ride" * 4096})
    present = survey(board)
    blocks = needed_blocks(plan(wanted(ending), present, False), present)

    board.fill("/rides/000/01/00001.rid", blocks - 1)
    files = board.files()
    result = command.run("flash")
    assert result.status == 2
    assert f"not enough room on the board: {blocks * BLOCK // 1000} kB needed" in result.err
    advice = "kickstand pull --delete, then flash again" if "nested" in which else "remove files of your own"
    assert advice in result.err
    assert result.err.count("\n") == 1
    assert board.files() == files
    assert board.resets == 1  # the board restarts, so its program runs again

    board.fill("/rides/000/01/00001.rid", blocks)
    command.works("flash")
    found = board.files()
    assert {path: found[path] for path in wanted(ending) if path != "/config.py"} == {
        path: data for path, data in wanted(ending).items() if path != "/config.py"
    }


def on_board(files, free_blocks=0):
    """Return a board with these files, in the form of survey()."""
    folders = frozenset(str(folder) for path in files for folder in PurePosixPath(path).parents) - {"/"}
    return BoardFiles({path: fingerprint(data) for path, data in files.items()}, folders, BLOCK, free_blocks, True)


@pytest.mark.parametrize("which", ["flat .mpy", "flat .py", "nested .mpy", "nested .py"])
def test_a_board_full_of_rides_has_room_for_an_update(which):
    """The recorder always keeps RESERVE bytes of flash free. Compiled firmware fits in the reserve, so no ride must be
    pulled before an update."""
    board = on_board(before(which))
    assert needed_blocks(plan(wanted(".mpy"), board, True), board) * BLOCK <= flash_ring.RESERVE


def test_sources_may_need_rides_to_be_pulled_first():
    """Computers without mpy-cross copy .py files, which take twice the space. If the .py files do not fit, the message
    says what to do."""
    board = on_board(before("nested .mpy"), flash_ring.RESERVE // BLOCK)
    with pytest.raises(InputError, match="kickstand pull --delete, then flash again"):
        refuse_without_room(plan(wanted(".py"), board, True), board)


def test_ring_of_rides_knows_the_size_of_the_firmware():
    """FIRMWARE is the space that the firmware takes in littlefs, with the two blocks of the file system itself. The
    ring treats the rest of the flash as space for rides."""
    board = fresh()
    board.put(wanted(".mpy"))
    taken = board.system.used_block_count * BLOCK
    assert taken <= flash_ring.FIRMWARE <= taken + 10 * BLOCK


def test_plain_mpremote_needs_the_documented_space():
    """Plain mpremote copies each .py file, and the .mpy file beside it stays on the board."""
    blocks = sum(update.most_blocks(len(data), BLOCK) for data in wanted(".py").values())
    assert 0.9 * 730 < blocks * BLOCK / 1024 <= 730


@pytest.mark.parametrize("size", [0, 1, 512, 513, 4096, 4097, 8188, 8189, 12276, 100_000, 400_001])
@pytest.mark.parametrize("port", PORTS)
def test_file_takes_between_least_and_most_blocks(port, size):
    board = fresh(port)
    board.put({"/other": b""})
    free = board.free
    board.put({"/file": bytes(size)})
    assert update.least_blocks(size, BLOCK) <= free - board.free <= update.most_blocks(size, BLOCK)
    assert update.most_blocks(size, BLOCK) - update.least_blocks(size, BLOCK) == (size <= BLOCK // 8)
