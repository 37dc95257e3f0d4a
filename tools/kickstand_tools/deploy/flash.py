"""Updates the firmware on a board: copies and verifies changed files, and removes files of older versions."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from mpremote.transport_serial import SerialTransport

from ..common import firmware_path
from ..common.errors import InputError
from . import bytecode, config_check, others
from .board_files import fingerprint, survey
from .config_text import cleaned
from .connection import ConnectedBoard, Port, Progress, ask, connected, describe, restart
from .firmware_files import CONFIG, contents, unfinished
from .update import Update, plan, refuse_without_room

_TRIES = 3  # attempts to copy a file, because a cable may lose a byte
_CHUNK = 2048  # bytes per transfer; with mpremote's 256, copying takes 1.5 times as long


@dataclass(frozen=True)
class InstallResult:
    """Paths on the board.

    copied: files that were copied and verified. copied_bytes: their size. kept: files that were not changed. removed:
    files of older versions. config_differs: True if the user's config.py, which is kept, is not this version's.
    """

    copied: list[str]
    copied_bytes: int
    kept: list[str]
    removed: list[str]
    config_differs: bool


@dataclass(frozen=True)
class FlashResult:
    """board: the board's name and its version of MicroPython. port: the port's name. config: the config.py that was
    checked before copying, or None. others: one line per file of another project, kept under another name. unused:
    settings in the user's config.py that are behind a '#'. why_sources: the reason why the firmware was not compiled,
    or None. installed: the files."""

    board: str
    port: str
    config: Path | None
    others: list[str]
    unused: list[str]
    why_sources: str | None
    installed: InstallResult


def flash(
    port: Port,
    replace_config: bool = False,
    progress: Progress | None = None,
    describe: Callable[[ConnectedBoard, str], str] = describe,
    compiler: bytecode.Compiler | None = None,
    judge: Callable[[Path, str, str], config_check.Judged] | None = None,
    agree: Callable[[list[str]], None] | None = None,
) -> FlashResult:
    """Bring a board's files up to date, verify them and restart it.

    replace_config: also update the user's config.py. describe: returns the board's name, and refuses other devices.
    compiler, judge: functions to use where mpy-cross or another process cannot run; None: bytecode.cross_compiled() and
    config_check.judge(). agree: called with one line per file of another project that will be renamed; may raise
    InputError. Raises InputError. If the board has too little room, nothing is changed.
    """
    with connected(port) as (transport, name):
        board = describe(transport, name)
        source = firmware_path.config()
        try:
            names = "(lambda s: (s.platform, getattr(s.implementation, '_machine', '')))(__import__('sys'))"
            machine = ask(transport, names, (str, str))

            def judged_here(path: Path) -> config_check.Judged:
                return (judge or config_check.judge)(path, *machine)

            there = others.find(others.read(transport), judged_here, replace_config)
            config = source if replace_config or there.config is None else None
            judged = judged_here(source)
            if config and judged.fault:
                raise InputError(judged.fault, config_check.CORRECT)
            wanted, why_sources = _contents(transport, compiler)
            wanted[CONFIG] = cleaned(source.read_bytes())
            if not config and there.mended and there.config is not None:
                wanted[CONFIG] = there.config
            update = prepare(transport, wanted, bool(config) or there.mended, there)
            if there.moves and agree:
                agree(there.words())
        except InputError:
            restart(transport)  # start the interrupted program again
            raise
        installed = install(transport, update, progress)
        restart(transport)
    return FlashResult(board, name, config, there.words(), judged.unused, why_sources, installed)


def prepare(
    transport: SerialTransport,
    wanted: dict[str, bytes],
    replace_config: bool = False,
    there: others.Others | None = None,
) -> Update:
    """Plan the Update for install(), without changing the board. wanted: see contents(). there: the files of other
    projects. Raises InputError."""
    present = there.files if there else survey(transport)
    update = plan(wanted, present, replace_config)
    if there and there.moves:
        update = replace(update, moves=there.moves)
    refuse_without_room(update, present)
    return update


def install(transport: SerialTransport, update: Update, progress: Progress | None = None) -> InstallResult:
    """Carry out an update. Raises InputError if a file reads back differently; also OSError and TransportError.

    main.py is removed first, and copied after the other files are verified. After an interruption, the board therefore
    starts nothing and can be flashed again. It never runs a mixture of versions.
    """
    for path, to in update.moves.items():
        transport.exec(f"import os\nos.rename({path!r}, {to!r})")
    for path in update.remove:
        transport.fs_rmfile(path)
    for folder in update.remove_folders:
        transport.fs_rmdir(folder)
    for folder in update.make_folders:
        transport.fs_mkdir(folder)
    total, done = sum(len(data) for data in update.copy.values()), 0
    left = update.copy
    for attempt in range(_TRIES):
        for path, data in left.items():

            def written(count: int, _size: int, what: str = f"copying {path[1:]}", before: int = done) -> None:
                if progress:
                    progress(what, min(before + count, total), total)

            transport.fs_writefile(unfinished(path), data, chunk_size=_CHUNK, progress_callback=written)
            done += len(data)
        left = _differing(transport, left)
        if not left:
            break
        if attempt == _TRIES - 1:
            raise InputError(
                f"{next(iter(left))[1:]} reads back differently, {_TRIES} times: the connection loses bytes, use "
                "another USB cable or port and try again; if that does not help, the flash is worn out"
            )
    for path in update.copy:
        if unfinished(path) != path:
            transport.exec(f"import os\nos.rename({unfinished(path)!r}, {path!r})")
    return InstallResult(list(update.copy), total, update.keep, update.obsolete, update.config_differs)


def _contents(transport: SerialTransport, compiler: bytecode.Compiler | None) -> tuple[dict[str, bytes], str | None]:
    """The firmware for this board, and the reason why it is not compiled, or None."""
    # 0: the board accepts no compiled files
    mpy = ask(transport, "getattr(__import__('sys').implementation, '_mpy', 0)", int)
    try:
        return contents(mpy, compiler), None
    except bytecode.CannotCompile as reason:
        return contents(None), str(reason)


def _differing(transport: SerialTransport, copied: dict[str, bytes]) -> dict[str, bytes]:
    """The files that read back from the board with another content than sent."""
    found = survey(transport).files if copied else {}
    return {path: data for path, data in copied.items() if found.get(unfinished(path)) != fingerprint(data)}
