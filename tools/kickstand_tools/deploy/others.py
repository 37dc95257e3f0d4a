"""Finds another project's main.py, boot.py and config.py on a used board. These files are renamed and kept."""

import ast
import hashlib
import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mpremote.transport_serial import SerialTransport

from ..common import installation
from ..common.messages import InputError, Remedy
from .config_check import CORRECT, Judged
from .config_text import cleaned
from .firmware_files import CONFIG, MAIN, PACKAGE
from .update import BoardFiles, survey

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
    """The files that were on a board, and the decisions about them.

    files: files and folders of the board, after renaming.
    moves: new path of each file to rename, by its present path.
    config: content that the user's config.py should have. None if there is none, or if it is renamed.
    mended: True if `config` differs from the present content.
    """

    files: BoardFiles
    moves: dict[str, str]
    config: bytes | None
    mended: bool

    def words(self) -> list[str]:
        """Return one line of text for each file to rename."""
        return [f"{path[1:]} on the board is another project's: kept as {to[1:]}" for path, to in self.moves.items()]


@dataclass(frozen=True)
class Contents:
    """Files and folders of a board, and the contents of its MAIN, BOOT and CONFIG by path."""

    files: BoardFiles
    texts: dict[str, bytes]


def read(transport: SerialTransport) -> Contents:
    """Read the board's files, without changing anything."""
    files = survey(transport)
    present = [path for path in (MAIN, BOOT, CONFIG) if path in files.files]
    return Contents(files, {path: bytes(transport.fs_readfile(path)) for path in present})


def find(there: Contents, judge: Callable[[Path], Judged], replace_config: bool) -> Others:
    """Decide which files to rename. judge: checks a config.py. replace_config: True if the user's will be replaced.

    Raises InputError if the user's config.py would stop the firmware.
    """
    installed = PACKAGE in there.files.folders
    leave = []
    if MAIN in there.texts and not _is_own_main(there.texts[MAIN]):
        leave.append(MAIN)
    if not installed and _does_something(there.texts.get(BOOT, b"")):
        leave.append(BOOT)
    config_text, mended = there.texts.get(CONFIG), False
    if config_text is not None and not (installed and replace_config):
        config, fault = _check_config(config_text, judge)
        ours = _settings_named(config)
        if installed:
            foreign = fault and not ours
        else:
            foreign = not ours or (fault and ours < _MANY)
        if foreign and _does_something(config):
            leave.append(CONFIG)
            config_text = None
        elif fault and not replace_config:
            raise InputError(fault, _CORRECT_OR_REPLACE)
        else:
            config_text, mended = config, config != config_text
    names = set(there.files.files)
    moves = {}
    for path in leave:
        moves[path] = _free_name(path, names)
        names.add(moves[path])
    return Others(_after_renaming(there.files, moves), moves, config_text, mended)


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


def _after_renaming(files: BoardFiles, moves: dict[str, str]) -> BoardFiles:
    renamed = {moves.get(path, path): mark for path, mark in files.files.items()}
    return BoardFiles(renamed, files.folders, files.block, files.free_blocks, files.has_rides)
