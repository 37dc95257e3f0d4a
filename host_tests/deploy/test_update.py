"""Updates of a board with an older version: what is removed, a power cut before any change, and the required room."""

import functools
from pathlib import PurePosixPath
from typing import Any

import pytest
from kickstand.rides import ride_files
from kickstand_tools.deploy import firmware_files, flash, update
from kickstand_tools.deploy.update import BoardFiles, fingerprint, needed_blocks, plan, refuse_without_room, survey
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
FLAT_BYTES = {".mpy": 1800, ".py": 5000}  # size of most files
FLAT_SMALL_BYTES = 400  # size of every sixth file; littlefs may store such a small file inside its folder
NOTES = {"/kickstand/notes.txt": b"mine", "/kickstand_a.cal": b"calibration"}
CONFIG = {"/config.py": b"# 0.2.0\n" * 700}


@functools.cache
def contents(ending):
    return firmware_files.contents(firmware_files.PICO if ending == ".mpy" else None)


def earlier(version):
    """Return the files of an older version on a board.

    version: "nothing", or the layout ("flat" or "nested") and the ending of its files, such as "flat .py".
    """
    if version == "nothing":
        return {}
    layout, ending = version.split()
    if layout == "nested":  # in this version every module differs from the new version
        modules = {path: data[:-1] + b"#" for path, data in contents(ending).items() if path.startswith("/kick")}
    else:
        modules = {
            f"/kickstand/{name}{ending}": bytes(FLAT_BYTES[ending] if i % 6 else FLAT_SMALL_BYTES)
            for i, name in enumerate(FLAT)
        }
    return modules | CONFIG | {"/main.py": contents(".py")["/main.py"]}


def board_with(files, port="rp2", ending=".mpy") -> Any:
    board: Any = LittlefsBoard(port, mpy=firmware_files.PICO if ending == ".mpy" else 0)
    board.put(files)
    return board


@pytest.mark.parametrize("ending", [".mpy", ".py"])
def test_flat_modules_of_old_versions_are_removed(monkeypatch, ending):
    user_files = NOTES | {"/kickstand/own/a.txt": b""}
    board = board_with(earlier("flat " + ending) | user_files | {"/kickstand/lean/old/older.py": b"pass"})
    board.system.makedirs("/kickstand/errors")  # a folder of this name would hide errors.mpy from the import
    result = command.works("flash", "--yes") if fake_board.plug_in(monkeypatch, board) else None
    expected = contents(".mpy") | user_files | CONFIG
    assert board.files() == expected
    assert board.folders() == {path.rpartition("/")[0] for path in expected} - {""}
    assert result and "files that are no longer part of the firmware" in result.out


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


class PowerCut(ConnectionError):
    pass


def cut_before(board, number):
    """Cut the power before the change with this number."""
    numbers = iter(range(number))

    def before_change():
        if next(numbers, None) is None:
            raise PowerCut("device disconnected")

    board.before_change = before_change


def test_interrupted_update_starts_nothing_and_is_repeatable():
    number, cut, config, steps = 0, True, b"", None
    while cut:
        board = board_with(SMALL_OLD | NOTES)
        cut_before(board, number)
        try:
            steps = plan(SMALL_NEW, survey(board), True)
            flash.install(board, steps)
            cut = False
        except PowerCut:
            board.power_cycle()
        files = board.files()
        assert number or files == SMALL_OLD | NOTES
        if cut:
            assert ("/main.py" in files) == (number == 0) and NOTES.items() <= files.items()
            board.before_change = lambda: None
            flash.install(board, plan(SMALL_NEW, survey(board)))
        # config.py is complete; the repetition keeps it, because it has no --config
        config = files.get("/config.py", SMALL_NEW["/config.py"])
        assert config in (SMALL_OLD["/config.py"], SMALL_NEW["/config.py"])
        assert board.files() == SMALL_NEW | NOTES | {"/config.py": config}, f"after a cut before change {number}"
        assert board.folders() == {"/kickstand", "/kickstand/lean"}
        number += 1
    assert steps and number > 25 and config == SMALL_NEW["/config.py"]
    assert sorted(steps.obsolete) == ["/kickstand/empty/old.py", "/kickstand/lean.mpy", "/kickstand/lean_filter.py"]
    assert steps.keep == ["/kickstand/errors.mpy"] and list(steps.copy)[-1] == "/main.py" and not steps.config_differs
    assert sum(map(len, steps.copy.values())) == 3 + 3000 + 3 + 3000 + 3000


def listed(files, free_blocks=0):
    """Return a board with these files, as survey() lists it."""
    folders = frozenset(str(folder) for path in files for folder in PurePosixPath(path).parents) - {"/"}
    return BoardFiles({path: fingerprint(data) for path, data in files.items()}, folders, BLOCK, free_blocks, True)


@pytest.mark.parametrize("version", ["flat .mpy", "flat .py", "nested .mpy", "nested .py"])
def test_board_full_of_rides_has_room_for_an_update(version):
    """The recorder always keeps RESERVE bytes of flash free, so no ride must be pulled before an update."""
    board = listed(earlier(version))
    assert needed_blocks(plan(contents(".mpy"), board, True), board) * BLOCK <= ride_files.RESERVE


def test_ring_of_rides_knows_the_size_of_the_firmware():
    """FIRMWARE is the space that the firmware takes in littlefs, with the two blocks of the file system itself. The
    ring treats the rest of the flash as space for rides."""
    used = board_with(contents(".mpy")).system.used_block_count * BLOCK
    assert used <= ride_files.FIRMWARE <= used + 10 * BLOCK


@pytest.mark.parametrize(
    ("size", "most"),
    [(0, 1), (1, 1), (512, 1), (513, 1), (4096, 1), (4097, 2), (8188, 2), (8189, 3), (12_276, 3), (400_001, 98)],
)
def test_file_takes_between_least_and_most_blocks(size, most):
    """Block n > 0 begins with a pointer, and with one more for each time that n can be halved (littlefs, DESIGN.md)."""
    assert update.most_blocks(size, BLOCK) == most
    assert most - update.least_blocks(size, BLOCK) == (size <= BLOCK // 8)
    for port in PORTS:
        board = board_with({"/other": b""}, port)
        free = board.free
        board.put({"/file": bytes(size)})
        assert update.least_blocks(size, BLOCK) <= free - board.free <= most


def test_room_for_an_update_by_hand():
    """Three files need 1, 2 and 1 blocks. A removed file frees 2 blocks. A new folder takes 2 blocks, and 4 blocks must
    stay free."""
    steps = update.Update(["/old"], [], ["/new"], {"/a": b"x", "/b": bytes(5000), "/main.py": b"m"}, [], [], False)
    board = BoardFiles({"/old": update.Fingerprint(5000, b"")}, frozenset(), 4096, 8, False)
    assert needed_blocks(steps, board) == 1 + 2 + 1 - 2 + 2 + 4
    refuse_without_room(steps, board)
    smaller = update.Update(["/old", "/old"], ["/p", "/q"], [], {"/a": b"x"}, [], [], False)
    assert needed_blocks(smaller, board) == 4
    assert needed_blocks(update.Update(["/old"], [], [], {}, [], [], False), board) == 0


def test_files_of_an_interrupted_update_are_removed():
    left_over = plan({"/main.py": b"/main.py"}, listed({"/main.py": b"/main.py", "/main.new": b"x"}), False)
    assert left_over.remove == ["/main.py", "/main.new"] and list(left_over.copy) == ["/main.py"]
    unchanged = plan({"/main.py": b"/main.py"}, listed({"/main.py": b"/main.py"}), False)
    assert (unchanged.copy, unchanged.remove, unchanged.keep) == ({}, [], ["/main.py"])
