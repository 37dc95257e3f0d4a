"""Tests the plan, the required space and the steps of an update, and how files of other projects are treated."""

from typing import Any

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import (
    config_check,
    flash,
    others,
    update,
)  # fmt: skip
from kickstand_tools.deploy.board_files import BoardFiles, fingerprint
from kickstand_tools.deploy.firmware_files import unfinished


def files(*paths, folders=("/kickstand",), block=4096, free=100, rides=False, **sizes):
    there = {path: fingerprint(path.encode()) for path in paths}
    return BoardFiles(there | sizes, frozenset(folders), block, free, rides)


def test_a_plan_replaces_what_differs():
    wanted = {"/kickstand/a.py": b"/kickstand/a.py", "/kickstand/b/c.py": b"new", "/config.py": b"c", "/main.py": b"m"}
    there = files("/kickstand/a.py", "/kickstand/old.py", "/kickstand/a.mpy", "/main.py", "/config.py", "/user.py",
                  folders=("/kickstand", "/kickstand/x", "/kickstand/x/y"))  # fmt: skip
    made = update.plan(wanted, there, False)
    assert made.remove == ["/main.py", "/kickstand/old.py", "/kickstand/a.mpy"]
    assert made.remove_folders == ["/kickstand/x/y", "/kickstand/x"] and made.make_folders == ["/kickstand/b"]
    assert list(made.copy) == ["/kickstand/b/c.py", "/main.py"] and made.obsolete == ["/kickstand/old.py"]
    assert made.keep == ["/kickstand/a.py", "/config.py"] and made.config_differs
    replaced = update.plan(wanted, there, True)
    assert "/config.py" in replaced.copy and "/config.py" not in replaced.remove and not replaced.config_differs
    same = update.plan({"/main.py": b"/main.py"}, files("/main.py", folders=()), False)
    assert (same.copy, same.remove, same.keep) == ({}, [], ["/main.py"])
    assert (
        "/main.new" in update.plan({"/main.py": b"/main.py"}, files("/main.py", "/main.new", folders=()), False).remove
    )


def test_the_blocks_of_a_file_have_pointers():
    """The second block begins with one pointer, and the third block with two pointers. So three blocks of 4096 hold
    12276 bytes."""
    for size, most in ((0, 1), (4096, 1), (4097, 2), (8188, 2), (8189, 3), (12_276, 3), (12_277, 4)):
        assert update.most_blocks(size, 4096) == most
    assert [update.least_blocks(size, 4096) for size in (512, 513, 5000)] == [0, 1, 2]


def test_the_room_for_an_update_by_hand():
    """Three files need 1, 2 and 1 blocks. A removed file frees 2 blocks. A new folder takes 2 blocks, and 4 blocks must
    stay free."""
    copy = {"/a": b"x", "/b": bytes(5000), "/main.py": b"m"}
    made = update.Update(["/old"], [], ["/new"], copy, [], [], False)
    there = BoardFiles({"/old": (5000, b"")}, frozenset(), 4096, 8, False)
    assert update.needed_blocks(made, there) == 1 + 2 + 1 - 2 + 2 + 4
    update.refuse_without_room(made, there)
    with pytest.raises(InputError, match="32 kB needed, 28 kB free"):
        update.refuse_without_room(made, BoardFiles(there.files, there.folders, 4096, 7, False))
    much = update.Update(["/old", "/old"], ["/p", "/q"], [], {"/a": b"x"}, [], [], False)
    assert update.needed_blocks(much, there) == 4
    assert update.needed_blocks(update.Update(["/old"], [], [], {}, [], [], False), there) == 0


def test_files_in_the_way_of_a_module_are_named():
    for path in ("/kickstand/a/x.txt", "/kickstand"):
        with pytest.raises(InputError, match=f"{path[1:]} on the board is in the way"):
            update._refuse_in_the_way({"/kickstand/a.py": b""}, {"/kickstand"}, {path})
    update._refuse_in_the_way({"/kickstand/a.py": b""}, {"/kickstand"}, {"/kickstand/b/x.txt", "/a"})


class Written:
    """A board that keeps what is written, and loses a byte of some files."""

    def __init__(self, loses=0):
        self.files: dict[str, bytes] = {}
        self.did: list[str] = []
        self.loses = loses

    def exec(self, code):
        self.did.append(code.partition("\n")[2])

    def fs_writefile(self, path, data, chunk_size, progress_callback):
        progress_callback(len(data) // 2, 0)
        progress_callback(len(data), 0)
        self.files[path] = data[:-1] if self.loses > 0 else data
        self.loses -= 1

    def __getattr__(self, name):
        return lambda path: self.did.append(f"{name[3:]} {path}")


def test_an_update_is_carried_out_in_its_order(monkeypatch):
    board: Any = Written(loses=1)
    monkeypatch.setattr(flash, "survey", lambda of: BoardFiles(
        {path: fingerprint(data) for path, data in of.files.items()}, frozenset(), 1, 1, False))  # fmt: skip
    made = update.Update(
        ["/r"], ["/f"], ["/n"], {"/a.py": b"1234", "/main.py": b"12"}, ["/r"], ["/k"], True, {"/x": "/y"}
    )
    seen: list = []
    found = flash.install(board, made, lambda *of: seen.append(of))
    assert board.did == [
        "os.rename('/x', '/y')",
        "rmfile /r",
        "rmdir /f",
        "mkdir /n",
        "os.rename('/main.new', '/main.py')",
    ]
    assert board.files == {"/a.py": b"1234", "/main.new": b"12"}
    assert seen[:4] == [
        ("copying a.py", 2, 6),
        ("copying a.py", 4, 6),
        ("copying main.py", 5, 6),
        ("copying main.py", 6, 6),
    ]
    assert seen[4:] == [("copying a.py", 6, 6)] * 2  # the file that has lost a byte is sent again
    assert (found.copied, found.copied_bytes, found.kept, found.removed) == (["/a.py", "/main.py"], 6, ["/k"], ["/r"])
    board = Written(loses=99)
    with pytest.raises(InputError, match=rf"a.py reads back differently, {flash._TRIES} times"):
        flash.install(board, made)
    assert [unfinished(path) for path in ("/main.py", "/config.py", "/a.py")] == ["/main.new", "/config.new", "/a.py"]


def found_others(texts, folders=(), fault=None, replace_config=False):
    there = others.Contents(files(*texts, folders=folders), {path: text.encode() for path, text in texts.items()})
    return others.find(there, lambda path: config_check.Judged(fault and f"{path}: {fault}", []), replace_config)


OURS = "SIDE = 'left'\nRECORD = True\nDISPLAY = 1\n"


def test_files_of_another_project_are_renamed():
    assert found_others({"/main.py": "print(1)"}).moves == {"/main.py": "/main-before-kickstand.py"}
    there = {"/main.py": "print(1)", "/boot.py": "x = 1", "/config.py": "y = 2", "/main-before-kickstand.py": ""}
    assert found_others(there).moves == {
        "/main.py": "/main-before-kickstand-2.py", "/boot.py": "/boot-before-kickstand.py",
        "/config.py": "/config-before-kickstand.py",
    }  # fmt: skip
    assert not found_others({"/boot.py": "'text'\n# comment"}).moves
    assert not found_others({"/boot.py": "x = 1"}, folders=("/kickstand",)).moves
    assert found_others({"/boot.py": "x ="}).moves


def test_a_config_belongs_to_the_project_that_it_sets():
    kept = found_others({"/config.py": OURS})
    assert not kept.moves and kept.config == OURS.encode() and not kept.mended
    assert found_others({"/config.py": "\ufeff" + OURS}).mended
    with pytest.raises(InputError, match=r"config\.py on the board: wrong"):
        found_others({"/config.py": OURS}, fault="wrong")
    # two settings are too few for a config.py of Kickstand
    assert found_others({"/config.py": "DISPLAY = 1\nSIDE = 2\n"}, fault="wrong").moves
    assert not found_others({"/config.py": "DISPLAY = 1\nSIDE = 2\n"}).moves
    assert found_others({"/config.py": "x = 1"}, ("/kickstand",), "wrong").moves
    assert not found_others({"/config.py": "x = 1"}, ("/kickstand",)).moves
    with pytest.raises(InputError):
        found_others({"/config.py": "SIDE = 1"}, ("/kickstand",), "wrong")
    replaced = found_others({"/config.py": "SIDE = 1"}, ("/kickstand",), "wrong", True)
    assert replaced.config == b"SIDE = 1" and not replaced.moves
    assert not found_others({"/config.py": "# nothing"}).moves
