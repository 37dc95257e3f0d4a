"""Updates the firmware on a board: copies and verifies files that differ, removes files of older versions."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mpremote.transport_serial import SerialTransport

from .. import firmware_path
from ..errors import InputError
from . import bytecode, config_check
from .board_files import fingerprint, survey
from .connection import Board, Port, Progress, ask, connected, describe, restart
from .firmware_files import CONFIG, contents, unfinished
from .update import Update, plan, refuse_without_room

_CHUNK = 2048  # bytes per exchange; with mpremote's 256 copying takes half as long again


@dataclass(frozen=True)
class InstallResult:
    """Paths on the board.

    copied: files that were verified to read back as they were sent.  copied_bytes: their size.  kept: files that were
    not changed.  removed: files of older versions.  config_differs: the rider's config.py, which is kept, is not this
    version's.
    """

    copied: list[str]
    copied_bytes: int
    kept: list[str]
    removed: list[str]
    config_differs: bool


@dataclass(frozen=True)
class FlashResult:
    """board: its name and version of MicroPython.  port: its name.  config: the config.py that was checked to be
    copied, or None.  unused: settings in the rider's config.py that are behind a '#'.  why_sources: why the firmware
    was not compiled, or None.  installed: the files."""

    board: str
    port: str
    config: Path | None
    unused: list[str]
    why_sources: str | None
    installed: InstallResult


def flash(
    port: Port,
    replace_config: bool = False,
    progress: Progress | None = None,
    describe: Callable[[Board, str], str] = describe,
    compiler: bytecode.Compiler | None = None,
    judge: Callable[[Path, str, str], config_check.Judged] | None = None,
) -> FlashResult:
    """Bring a board's files up to date, verify them and restart it.

    replace_config: update the rider's config.py too.  describe: returns the board's name, and refuses other devices.
    compiler, judge: replacements where mpy-cross, or another process, cannot be run; None: bytecode.cross_compiled()
    and config_check.judge().  Raises InputError, for want of room before anything is changed.
    """
    with connected(port) as (transport, name):
        board = describe(transport, name)
        source = firmware_path.config()
        there = ask(transport, "[entry[0] for entry in __import__('os').ilistdir('/')]", list)
        config = source if replace_config or CONFIG[1:] not in there else None
        try:
            names = "(lambda s: (s.platform, getattr(s.implementation, '_machine', '')))(__import__('sys'))"
            judged = (judge or config_check.judge)(source, *ask(transport, names, (str, str)))
            if config and judged.fault:
                raise InputError(judged.fault)
            wanted, why_sources = _contents(transport, compiler)
            wanted[CONFIG] = source.read_bytes()
            update = prepare(transport, wanted, replace_config)
        except InputError:
            restart(transport)  # the board's program goes on
            raise
        installed = install(transport, update, progress)
        restart(transport)
    return FlashResult(board, name, config, judged.unused, why_sources, installed)


def prepare(transport: SerialTransport, wanted: dict[str, bytes], replace_config: bool = False) -> Update:
    """The Update that install() has to carry out. Changes nothing. wanted: see contents(). Raises
    InputError."""
    present = survey(transport)
    update = plan(wanted, present, replace_config)
    refuse_without_room(update, present)
    return update


def install(transport: SerialTransport, update: Update, progress: Progress | None = None) -> InstallResult:
    """Carry out an update. Raises InputError for what reads back differently, OSError, TransportError.

    main.py goes first, and comes back once all the rest is verified: broken off at any point, this leaves a board that
    starts nothing, never a mixture of versions, and so can be flashed again.
    """
    for path in update.remove:
        transport.fs_rmfile(path)
    for folder in update.remove_folders:
        transport.fs_rmdir(folder)
    for folder in update.make_folders:
        transport.fs_mkdir(folder)
    total, done = sum(len(data) for data in update.copy.values()), 0
    for path, data in update.copy.items():

        def written(count: int, _size: int, what: str = f"copying {path[1:]}", before: int = done) -> None:
            if progress:
                progress(what, before + count, total)

        transport.fs_writefile(unfinished(path), data, chunk_size=_CHUNK, progress_callback=written)
        done += len(data)
    _verify(transport, update.copy)
    for path in update.copy:
        if unfinished(path) != path:
            transport.exec(f"import os\nos.rename({unfinished(path)!r}, {path!r})")
    return InstallResult(list(update.copy), total, update.keep, update.obsolete, update.config_differs)


def _contents(transport: SerialTransport, compiler: bytecode.Compiler | None) -> tuple[dict[str, bytes], str | None]:
    """The firmware for this board, and why it is not compiled."""
    mpy = ask(transport, "getattr(__import__('sys').implementation, '_mpy', 0)", int)  # 0: takes no compiled files
    try:
        return contents(mpy, compiler), None
    except bytecode.CannotCompile as reason:
        return contents(None), str(reason)


def _verify(transport: SerialTransport, copied: dict[str, bytes]) -> None:
    """Raise InputError if the board reads something else than was sent."""
    found = survey(transport).files if copied else {}
    for path, data in copied.items():
        if found.get(unfinished(path)) != fingerprint(data):
            raise InputError(f"{path[1:]} reads back differently: try again; if it stays so, the flash is worn out")
