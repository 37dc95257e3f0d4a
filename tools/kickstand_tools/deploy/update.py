"""Lists the files on a board's flash, and plans an update: which files of another project to rename, which files and
folders to remove and to create, and whether the free space is enough.

The free space is computed from the rules of the file system littlefs. A file takes whole flash blocks, which are freed
when the file is removed, or when its replacement is closed. Each block after the first begins with pointers of 4 bytes
to earlier blocks (littlefs, DESIGN.md, "CTZ skip-lists"). A small file, up to an eighth of a block, may be stored in
the blocks of its folder. A folder takes two blocks, and two more if its entries do not fit.
"""

import ast
import hashlib
import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from mpremote.transport_serial import SerialTransport

from ..common import installation
from ..common.messages import InputError, Remedy
from .config_file import CORRECT, Judged, cleaned
from .connection import literal
from .firmware_files import CONFIG, MAIN, MODULE_ENDINGS, PACKAGE, unfinished

FOLDER_BLOCKS = 2
# Blocks that must stay free. A folder may need more than two blocks, and littlefs replaces a worn block before freeing
# it
SPARE_BLOCKS = 4
_POINTER = 4
# This program runs on the board, and prints these lines:
#   (path, size, SHA-256)              for each file in the root and below the package's folder
#   (path, None, None)                 for the package's folder and each folder below it
#   the folder of rides                if it contains rides
#   (bytes of a block, free blocks)    for the flash
_SURVEY = """
import hashlib, os
def survey(directory):
    for entry in os.ilistdir(directory or "/"):
        path = directory + "/" + entry[0]
        if entry[1] & 0x4000:
            if (path + "/").startswith("{PACKAGE}/"):
                print((path, None, None))
                survey(path)
            continue
        digest, size = hashlib.sha256(), 0
        with open(path, "rb") as file:
            while True:
                block = file.read(1024)
                if not block:
                    break
                size += len(block)
                digest.update(block)
        print((path, size, digest.digest()))
survey("")
if any("/" + entry[0] == "{RIDES}" for entry in os.ilistdir("/")) and list(os.ilistdir("{RIDES}")):
    print("{RIDES}")
s = os.statvfs("/")
print((s[0], s[3]))
"""
_RIDES = "/rides"  # folder of the rides in flash, see kickstand.rides.ride_files.directory()


class Fingerprint(NamedTuple):
    """What identifies the content of a file."""

    size: int  # in bytes
    sha256: bytes


@dataclass(frozen=True)
class BoardFiles:
    """The files on a board's flash."""

    files: dict[str, Fingerprint]  # of each file in the root and in the package, by path
    folders: frozenset[str]  # the package's folder and the folders below it
    block: int  # bytes of a flash block
    free_blocks: int
    has_rides: bool


def survey(transport: SerialTransport) -> BoardFiles:
    """List the files on the board's flash."""
    code = _SURVEY.replace("{PACKAGE}", PACKAGE).replace("{RIDES}", _RIDES)
    *lines, last = transport.exec(code).splitlines() or [b""]
    has_rides = _RIDES.encode() in lines[-1:]
    entries = [literal(line, (str, int, bytes), (str, None, None)) for line in lines[: len(lines) - has_rides]]
    block, free_blocks = literal(last, (int, int))
    return BoardFiles(
        {path: Fingerprint(size, digest) for path, size, digest in entries if size is not None},
        frozenset(path for path, size, _ in entries if size is None),
        block,
        free_blocks,
        has_rides,
    )


def fingerprint(data: bytes) -> Fingerprint:
    """Return the size and the SHA-256 of data, as in BoardFiles.files."""
    return Fingerprint(len(data), hashlib.sha256(data).digest())


# Another project's main.py, boot.py and config.py on a used board, which are renamed and kept

BOOT = "/boot.py"
_KEPT = "-before-kickstand"
# A file with this many of Kickstand's settings belongs to Kickstand. Another project may have a setting of the same
# name, such as DISPLAY
_MANY = 3
_ON_THE_BOARD = "config.py on the board"
# The first 16 digits of the SHA-256 of every released main.py of Kickstand, with \n as line end
_OWN_MAIN = set(
    "390e716171ec58a6 863631249d4a19b6 3ad59275b8eff314 caa779ca994cf25e aafb0009cd771b00 1f8719131f69c51c "
    "a53721c842ec6f79 4b6a95a0692ff2e4 7bf67c29fdfcfe88 441f1b005e130691 06436eea00d76f87 8744d5fdcd8f23fe "
    "901754b7b5d06b9c".split()
)
_CORRECT_OR_REPLACE = Remedy(
    f"{CORRECT.terminal}, or replace that file with kickstand flash --config", CORRECT.words(page=True)
)


@dataclass(frozen=True)
class Others:
    """The files that were on a board, and the decisions about them."""

    files: BoardFiles  # after renaming
    moves: dict[str, str]  # new path of each file to rename, by its present path
    config: bytes | None  # content that the user's config.py should have; None if there is none, or if it is renamed
    mended: bool  # True if `config` differs from the present content

    def words(self) -> list[str]:
        """Return one line of text for each file to rename."""
        return [f"{path[1:]} on the board is another project's: kept as {to[1:]}" for path, to in self.moves.items()]


@dataclass(frozen=True)
class Contents:
    """Files and folders of a board, and the contents of its MAIN, BOOT and CONFIG by path."""

    files: BoardFiles
    texts: dict[str, bytes]


def read_contents(transport: SerialTransport) -> Contents:
    """Read the board's files, without changing anything."""
    files = survey(transport)
    present = [path for path in (MAIN, BOOT, CONFIG) if path in files.files]
    return Contents(files, {path: bytes(transport.fs_readfile(path)) for path in present})


def find_others(contents: Contents, judge: Callable[[Path], Judged], replace_config: bool) -> Others:
    """Decide which files to rename. Raises InputError if the user's config.py would stop the firmware.

    judge: checks a config.py.
    replace_config: True if the user's config.py will be replaced.
    """
    installed = PACKAGE in contents.files.folders
    to_rename = []
    if MAIN in contents.texts and not _is_own_main(contents.texts[MAIN]):
        to_rename.append(MAIN)
    if not installed and _does_something(contents.texts.get(BOOT, b"")):
        to_rename.append(BOOT)
    config_text, mended = contents.texts.get(CONFIG), False
    if config_text is not None and not (installed and replace_config):
        config, fault = _check_config(config_text, judge)
        if not _is_ours(config, bool(fault), installed) and _does_something(config):
            to_rename.append(CONFIG)
            config_text = None
        elif fault and not replace_config:
            raise InputError(fault, _CORRECT_OR_REPLACE)
        else:
            config_text, mended = config, config != config_text
    names = set(contents.files.files)
    moves = {}
    for path in to_rename:
        moves[path] = _free_name(path, names)
        names.add(moves[path])
    renamed = {moves.get(path, path): mark for path, mark in contents.files.files.items()}
    return Others(replace(contents.files, files=renamed), moves, config_text, mended)


def _is_ours(config: bytes, has_fault: bool, installed: bool) -> bool:
    """True if a config.py is Kickstand's, by the number of settings in it.

    installed: True if the board has Kickstand. Then the user's own config.py may have no setting, if it has no fault.
    """
    settings = _settings_named(config)
    if installed:
        return bool(settings) or not has_fault
    return settings >= _MANY or (settings > 0 and not has_fault)


def _check_config(content: bytes, judge: Callable[[Path], Judged]) -> tuple[bytes, str | None]:
    """Return the content of a config.py in the encoding that MicroPython reads, and its fault or None."""
    try:
        content = cleaned(content)
    except InputError as error:
        return content, error.message.sentence().replace("config.py", _ON_THE_BOARD, 1)
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "config.py"
        path.write_bytes(content)
        fault = judge(path).fault
    return content, fault and fault.replace(str(path), _ON_THE_BOARD)


def _is_own_main(content: bytes) -> bool:
    text = content.replace(b"\r\n", b"\n")
    current = (installation.firmware() / "main.py").read_bytes().replace(b"\r\n", b"\n")
    return text == current or hashlib.sha256(text).hexdigest()[:16] in _OWN_MAIN


def _settings_named(content: bytes) -> int:
    """Return the number of Kickstand's settings in a config.py, including settings behind a '#'."""
    shipped = (installation.firmware() / "config.py").read_text(encoding="utf-8")
    setting = r"^(?:# )?([A-Z][A-Z_0-9]+) = "
    text = content.decode("utf-8", "replace").replace("\r\n", "\n")
    return len({*re.findall(setting, shipped, re.M)}.intersection(re.findall(r"^#? *([A-Z][A-Z_0-9]+) *=", text, re.M)))


def _does_something(content: bytes) -> bool:
    """True if the file has more than comments and strings, unlike the boot.py that MicroPython puts on an ESP32."""
    try:
        body = ast.parse(content).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return True
    return not all(isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) for node in body)


def _free_name(path: str, taken: set[str]) -> str:
    """Return the first unused name of main-before-kickstand.py, main-before-kickstand-2.py and so on."""
    stem = path.removesuffix(".py") + _KEPT
    names = [f"{stem}.py", *(f"{stem}-{n}.py" for n in range(2, len(taken) + 3))]
    return next(name for name in names if name not in taken)


# The plan


def most_blocks(size: int, block: int) -> int:
    """Return the largest number of flash blocks that a file can take. size, block: bytes of the file and of a block."""
    count = 1
    while size > block * count - _POINTER * (2 * (count - 1) - (count - 1).bit_count()):
        count += 1
    return count


def least_blocks(size: int, block: int) -> int:
    """Return the number of flash blocks that are certainly freed when a file of this size is removed."""
    return most_blocks(size, block) if size > block // 8 else 0


@dataclass(frozen=True)
class Update:
    """The steps of an update, in their order after the moves. A board that is up to date needs none."""

    remove: list[str]  # files to remove, main.py first
    remove_folders: list[str]  # these are empty by then
    make_folders: list[str]
    copy: dict[str, bytes]  # contents of the files to copy, by path, main.py last
    obsolete: list[str]  # the removed files that belong to no module of this version
    keep: list[str]  # files that stay unchanged
    config_differs: bool  # True if the user's config.py is kept and differs from this version's
    moves: dict[str, str] = field(default_factory=dict)  # see Others


def plan(
    wanted: dict[str, bytes], board: BoardFiles, replace_config: bool = False, moves: dict[str, str] | None = None
) -> Update:
    """Plan the Update that gives the board the wanted files. The user's own files are kept.

    Files to replace are removed first, which frees their blocks. An interruption is harmless, because a board without
    main.py starts nothing and can be flashed again.

    wanted: contents of the wanted files, by path.
    replace_config: also replace the user's config.py.
    Raises InputError if a file of the user is in the way.
    """
    copy = {path: data for path, data in wanted.items() if board.files.get(path) != fingerprint(data)}
    config_differs = CONFIG in copy and CONFIG in board.files and not replace_config
    if config_differs:
        del copy[CONFIG]
    left_over = {unfinished(MAIN), unfinished(CONFIG)}  # an interrupted update leaves these files
    stale = [path for path in board.files if path in left_over or (_is_module(path) and path not in wanted)]
    existing = board.files.keys() - set(stale)
    folders = {folder for path in wanted for folder in _folders(path)}
    empty = board.folders.difference(folders, *map(_folders, existing))
    _refuse_in_the_way(wanted, folders, existing)
    if copy or stale or empty:
        copy[MAIN] = copy.pop(MAIN, wanted[MAIN])
    in_order = dict.fromkeys([MAIN, *stale, *copy] if copy else [])
    modules = {_module(path) for path in wanted}
    return Update(
        remove=[path for path in in_order if path in board.files and path != CONFIG],  # config.py belongs to the user
        remove_folders=sorted(empty, reverse=True),  # inner folders first
        make_folders=sorted(folders - board.folders),
        copy=copy,
        obsolete=[path for path in stale if _module(path) not in modules],
        keep=[path for path in wanted if path not in copy],
        config_differs=config_differs,
        moves=moves or {},
    )


def needed_blocks(update: Update, board: BoardFiles) -> int:
    """Return the number of flash blocks that must be free for an update.

    It is rounded to the safe side: copied files count with their most blocks, and removed files with their least.
    """
    if not update.copy:
        return 0
    takes = sum(most_blocks(len(data), board.block) for data in update.copy.values())
    frees = sum(least_blocks(board.files[path].size, board.block) for path in update.remove)
    folders = len(update.make_folders) - len(update.remove_folders)
    return max(0, takes - frees + FOLDER_BLOCKS * folders) + SPARE_BLOCKS


def refuse_without_room(update: Update, board: BoardFiles) -> None:
    """Raise InputError if the flash has not enough room for an update."""
    blocks = needed_blocks(update, board)
    if blocks <= board.free_blocks:
        return
    remedy = Remedy("remove files of your own from it")
    if board.has_rides and f"{PACKAGE}/rides" in board.folders:  # firmware up to 0.4 cannot send its rides
        remedy = Remedy(
            "pull the rides with kickstand pull --delete, then flash again",
            "save the rides with the page Live, delete them on the board by its menu, then install again",
        )
    needed_kb, free_kb = (count * board.block // 1000 for count in (blocks, board.free_blocks))
    raise InputError(f"not enough room on the board: {needed_kb} kB needed, {free_kb} kB free", remedy)


def _is_module(path: str) -> bool:
    return path.startswith(PACKAGE + "/") and path.endswith(MODULE_ENDINGS)


def _module(path: str) -> str:
    return path.rpartition(".")[0]


def _folders(path: str) -> list[str]:
    """Return all folders that contain this path, except the root."""
    return [str(folder) for folder in PurePosixPath(path).parents[:-1]]


def _refuse_in_the_way(wanted: dict[str, bytes], folders: set[str], own_files: set[str]) -> None:
    """Raise InputError if MicroPython would import the user's lean/ or lean.py instead of lean.mpy."""
    modules = {_module(path) for path in wanted}
    for path in sorted(own_files):
        if path in folders or modules.intersection(_folders(path)):
            raise InputError(f"{path[1:]} on the board is in the way of the firmware: move it, then repeat this")
