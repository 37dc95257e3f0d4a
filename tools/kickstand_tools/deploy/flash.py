"""Updates the firmware on a board: copies and verifies changed files, and removes files of older versions."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mpremote.transport_serial import SerialTransport

from ..common import installation
from ..common.messages import InputError
from . import config_file
from .connection import Port, Progress, ask, connected, describe, restart
from .firmware_files import CONFIG, CannotCompile, Compiler, contents, unfinished
from .update import Update, find_others, fingerprint, plan, read_contents, refuse_without_room, survey

OLDEST = (1, 23)  # oldest supported version of MicroPython
PLATFORMS = ("rp2", "esp32")
_TRIES = 3  # number of attempts to copy a file, because a cable may lose a byte
_CHUNK = 2048  # bytes per transfer. With mpremote's default of 256 bytes, copying takes 1.5 times as long


@dataclass(frozen=True)
class FlashResult:
    """The result of flash()."""

    board: str  # its name and its version of MicroPython
    port: str
    config: Path | None  # the config.py that was checked before copying
    others: list[str]  # one line per file of another project that was kept under another name
    unused: list[str]  # settings in the user's config.py that are behind a '#'
    why_sources: str | None  # the reason why the firmware was not compiled
    update: Update  # the steps that were carried out


def describe_supported(transport: SerialTransport, name: str) -> str:
    """Describe the board as describe() does. Raises InputError for a board on which Kickstand does not run."""
    text = describe(transport, name)
    expression = "(lambda s: (s.implementation.version[0], s.implementation.version[1], s.platform))(__import__('sys'))"
    *version, platform = ask(transport, expression, (int, int, str))
    if tuple(version) < OLDEST:
        raise InputError(f"{text}: put MicroPython {OLDEST[0]}.{OLDEST[1]} or newer on the board first")
    if platform not in PLATFORMS:
        raise InputError(f"{text}: Kickstand runs on a Raspberry Pi Pico and on an ESP32")
    return text


def platform_and_machine(transport: SerialTransport) -> tuple[str, str]:
    """Return the board's sys.platform and sys.implementation._machine, which judge() of config_file.py needs."""
    names = "(lambda s: (s.platform, getattr(s.implementation, '_machine', '')))(__import__('sys'))"
    return ask(transport, names, (str, str))


def flash(
    port: Port,
    replace_config: bool = False,
    progress: Progress | None = None,
    compiler: Compiler | None = None,
    judge: Callable[[Path, str, str], config_file.Judged] | None = None,
    agree: Callable[[list[str]], None] | None = None,
) -> FlashResult:
    """Update a board's files, verify them, and restart the board.

    replace_config: also replace the user's config.py.
    compiler: compiles a module; None uses cross_compiled().
    judge: checks a config.py; None uses config_file.judge(), which starts a process.
    agree: called with one line per file of another project that will be renamed. It may raise InputError.
    Raises InputError if the board cannot be updated. If the board has too little room, nothing is changed.
    """
    with connected(port) as (transport, name):
        board = describe_supported(transport, name)
        source = installation.config()
        try:
            identity = platform_and_machine(transport)

            def judged_here(path: Path) -> config_file.Judged:
                return (judge or config_file.judge)(path, *identity)

            foreign = find_others(read_contents(transport), judged_here, replace_config)
            config = source if replace_config or foreign.config is None else None
            judged = judged_here(source)
            if config and judged.fault:
                raise InputError(judged.fault, config_file.CORRECT)
            contents, why_sources = _contents(transport, compiler)
            with contextlib.suppress(InputError):  # in another encoding it was refused above, if it was to be copied
                contents[CONFIG] = config_file.cleaned(source.read_bytes())
            if not config and foreign.mended and foreign.config is not None:
                contents[CONFIG] = foreign.config
            update = plan(contents, foreign.files, bool(config) or foreign.mended, foreign.moves)
            refuse_without_room(update, foreign.files)
            if foreign.moves and agree:
                agree(foreign.words())
        except InputError:
            restart(transport)  # start the interrupted program again
            raise
        install(transport, update, progress)
        restart(transport)
    return FlashResult(board, name, config, foreign.words(), judged.unused, why_sources, update)


def install(transport: SerialTransport, update: Update, progress: Progress | None = None) -> None:
    """Carry out an update, and verify the copied files.

    main.py is removed first. The new main.py gets its name only after all files are verified. So after an interruption,
    the board starts nothing and can be flashed again. The board never runs a mixture of versions.
    Raises InputError if a file reads back differently, and OSError or TransportError if the connection fails.
    """
    for path, to in update.moves.items():
        transport.exec(f"import os\nos.rename({path!r}, {to!r})")
    for path in update.remove:
        transport.fs_rmfile(path)
    for folder in update.remove_folders:
        transport.fs_rmdir(folder)
    for folder in update.make_folders:
        transport.fs_mkdir(folder)
    total, copied = sum(len(data) for data in update.copy.values()), 0
    remaining = update.copy
    for attempt in range(_TRIES):
        for path, data in remaining.items():

            def written(count: int, _size: int, what: str = f"copying {path[1:]}", before: int = copied) -> None:
                if progress:
                    progress(what, min(before + count, total), total)

            transport.fs_writefile(unfinished(path), data, chunk_size=_CHUNK, progress_callback=written)
            copied += len(data)
        remaining = _differing(transport, remaining)
        if not remaining:
            break
        if attempt == _TRIES - 1:
            raise InputError(
                f"{next(iter(remaining))[1:]} reads back differently, {_TRIES} times: the connection loses bytes, use "
                "another USB cable or port and try again; if that does not help, the flash is worn out"
            )
    for path in update.copy:
        if unfinished(path) != path:
            transport.exec(f"import os\nos.rename({unfinished(path)!r}, {path!r})")


def _contents(transport: SerialTransport, compiler: Compiler | None) -> tuple[dict[str, bytes], str | None]:
    """Return the firmware for this board, and the reason why it is not compiled, or None."""
    # 0 means that the board accepts no compiled files
    mpy = ask(transport, "getattr(__import__('sys').implementation, '_mpy', 0)", int)
    try:
        return contents(mpy, compiler), None
    except CannotCompile as reason:
        return contents(None), str(reason)


def _differing(transport: SerialTransport, copied: dict[str, bytes]) -> dict[str, bytes]:
    """Return the files whose content on the board differs from the content that was sent."""
    files = survey(transport).files if copied else {}
    return {path: data for path, data in copied.items() if files.get(unfinished(path)) != fingerprint(data)}
