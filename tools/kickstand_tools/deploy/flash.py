"""The firmware onto a board, and questions to it, by mpremote."""

import ast
import contextlib
import errno
import hashlib
import io
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from mpremote.transport import TransportError, TransportExecError
from mpremote.transport_serial import SerialTransport

from .. import firmware_path
from ..errors import InputError, cause
from ..progress import Bar
from . import bytecode, config_check
from .ports import find_port, why_closed

PACKAGE = "/kickstand"
MAIN = "/main.py"
CONFIG = "/config.py"  # the rider's own once it is on the board
_CHUNK = 2048  # bytes an exchange; with mpremote's 256 copying takes half as long again
_ANSWER_S = 10
_RESTART_S = 2  # until its port is back: the next command may follow at once
_STATUS_S = 60  # an emulated board takes a while to compile the modules

# Prints {path: (size, SHA-256)} of the files in the root, in the package's folder and in those below it.
_SURVEY = """
import hashlib, os
def survey(directory):
    for entry in os.ilistdir(directory or "/"):
        path = directory + "/" + entry[0]
        if entry[1] & 0x4000:
            if (path + "/").startswith("{PACKAGE}/"):
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
        print("%r: (%d, %r)," % (path, size, digest.digest()))
print("{")
survey("")
print("}")
""".replace("{PACKAGE}", PACKAGE)

Print = Callable[[str], None]


def firmware_files() -> dict[str, Path]:
    """Path on the board of each file of the firmware, in the order to copy them: what starts it is last."""
    root = firmware_path.directory()
    package = firmware_path.PACKAGE
    files = {f"{PACKAGE}/{path.relative_to(package).as_posix()}": path for path in sorted(package.rglob("*.py"))}
    return files | {CONFIG: root / "config.py", MAIN: root / "main.py"}


def contents(mpy: int | None) -> dict[str, bytes]:
    """firmware_files() as they are copied: the package as .mpy for a board with this sys.implementation._mpy, as
    .py for None; main.py and config.py, the rider's own, always as .py. Raises CannotCompile."""
    files = firmware_files()
    package = {path: source for path, source in files.items() if path.startswith(PACKAGE + "/")}
    rest = {path: source.read_bytes() for path, source in files.items() if path not in package}
    if mpy is None:
        return {path: source.read_bytes() for path, source in package.items()} | rest
    return bytecode.compiled(package, mpy) | rest


def flash(port: str | None, replace_config: bool, say: Print) -> None:
    """Bring a board's files up to date, verify them and restart it. Raises InputError."""
    with connected(port) as (transport, name):
        say(f"{_describe(transport, name)} on {name}")
        config = firmware_path.config()
        if replace_config or not transport.fs_exists(CONFIG):
            say(f"config.py is {config}")
            _check(config, transport)
        try:
            wanted = contents(_mpy(transport))
        except bytecode.CannotCompile as reason:
            say(f"note: {reason}: it gets the sources, and starts more slowly")
            wanted = contents(None)
        wanted[CONFIG] = config.read_bytes()
        install(transport, wanted, replace_config, say)
        restart(transport)
        say("restarted: the display shows the rest")


def status(port: str | None, say: Print) -> None:
    """Print what the board says of itself, and restart it. Raises InputError."""
    with connected(port) as (transport, name):
        _describe(transport, name)
        try:
            say(_status_text(transport, name))
        finally:
            restart(transport)


def install(transport: SerialTransport, wanted: dict[str, bytes], replace_config: bool, say: Print) -> None:
    """Copy what differs from wanted, verified by its hash, and remove what is no longer part.

    main.py goes first and comes back last: broken off at any point, this leaves a board that starts nothing,
    and so can be deployed to again.
    """
    present = _survey(transport)
    changed = {path: data for path, data in wanted.items() if present.get(path) != _fingerprint(data)}
    if CONFIG in changed and CONFIG in present and not replace_config:
        del changed[CONFIG]
        say("kept: config.py on the board is not this version's; --config would replace it")
    stale = [
        p for p in present if p.startswith(PACKAGE + "/") and p.endswith((".py", ".mpy")) and p not in wanted
    ]
    if stale or changed:
        changed[MAIN] = wanted[MAIN]
    _check_room(transport, changed, present)
    if MAIN in changed and MAIN in present:
        transport.fs_rmfile(MAIN)
    _remove(transport, stale, wanted, say)
    for folder in sorted({path.rpartition("/")[0] for path in changed} - {""}):
        if not transport.fs_isdir(folder):
            transport.fs_mkdir(folder)
    _copy(transport, changed)
    copied = _survey(transport) if changed else present
    for path, data in changed.items():
        if copied.get(path) != _fingerprint(data):
            raise InputError(
                f"{path[1:]} reads back differently: try again; if it stays so, the flash is worn out"
            )
    total = sum(len(data) for data in changed.values())
    same = len(wanted) - len(changed)
    say(f"copied {len(changed)} files, {total / 1000:.1f} kB, and verified them; {same} left as they were")


def restart(transport: SerialTransport) -> None:
    """Reset the board, so that it starts as after power-on. Its USB port goes away for a moment."""
    transport.exec_raw_no_follow("import time, machine\ntime.sleep_ms(100)\nmachine.reset()")
    time.sleep(_RESTART_S)


@contextlib.contextmanager
def connected(port: str | None) -> Iterator[tuple[SerialTransport, str]]:
    """A board at its raw prompt, the app interrupted, and the name of its port. Errors become InputError."""
    name = port or find_port()
    try:
        transport = SerialTransport(name, timeout=_ANSWER_S)
    except (TransportError, ValueError):
        raise why_closed(name) from None
    try:
        _enter(transport, name)
        yield transport, name
    except TransportExecError as error:
        raise InputError(f"{name}: the board reports {_last_line(error.error_output)}: try again") from error
    except TransportError as error:
        raise InputError(
            f"{name}: the board stopped answering: plug it in again, then repeat this"
        ) from error
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise InputError(f"the board at {name} is full: remove files of your own from it") from error
        raise InputError(
            f"{name}: connection lost ({cause(error)}): plug the board in again, then repeat"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            transport.close()  # its port may be gone, or just restarting


def refuse_absent(reason: str, name: str) -> None:
    """Raise InputError if this error of the board at that port says that it has no firmware."""
    if "no module named 'kickstand'" in reason:
        raise InputError(f"Kickstand is not on the board at {name}: kickstand flash puts it there")


def _enter(transport: SerialTransport, name: str) -> None:
    """Ctrl-C, then a soft reset into the raw prompt, which leaves main.py alone."""
    for last in (False, True):  # a board that resets when its port is opened is still starting the first time
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # mpremote prints what it did not understand
                transport.enter_raw_repl()
            return
        except TransportError:
            if last:
                raise InputError(
                    f"no MicroPython answers on {name}: check that this is the board's port, hold its button "
                    "while plugging it in, or put MicroPython on it"
                ) from None


def _describe(transport: SerialTransport, name: str) -> str:
    """Which board and MicroPython this is. Raises InputError for another Python."""
    implementation, version, machine = transport.eval(
        "(lambda i: (i.name, '.'.join(str(n) for n in i.version[:3]), getattr(i, '_machine', 'board')))"
        "(__import__('sys').implementation)"
    )
    if implementation != "micropython":
        raise InputError(f"{name} runs {implementation}: put MicroPython on the board first")
    return f"{machine}, MicroPython {version}"


def _mpy(transport: SerialTransport) -> int:
    """Which .mpy files it takes; 0: none."""
    return int(transport.eval("getattr(__import__('sys').implementation, '_mpy', 0)"))


def _check(config: Path, transport: SerialTransport) -> None:
    """Refuse a config.py that the board would not take; what runs there now goes on."""
    try:
        config_check.refuse_faulty(config, str(transport.eval("__import__('sys').platform")))
    except InputError:
        restart(transport)
        raise


def _survey(transport: SerialTransport) -> dict[str, tuple[int, bytes]]:
    """Size and SHA-256 of every file in the board's root and in the package's directory."""
    return ast.literal_eval(transport.exec(_SURVEY).decode())


def _status_text(transport: SerialTransport, name: str) -> str:
    out, error = transport.exec_raw("import kickstand\nkickstand.status()", timeout=_STATUS_S)
    reason = _last_line(error.decode(errors="replace"))
    refuse_absent(reason, name)
    if error:
        raise InputError(
            f"the board cannot tell its status ({reason}): bring it up to date with kickstand flash"
        )
    return out.decode(errors="replace").replace("\r\n", "\n").rstrip()


def _fingerprint(data: bytes) -> tuple[int, bytes]:
    return len(data), hashlib.sha256(data).digest()


def _remove(transport: SerialTransport, stale: list[str], wanted: dict[str, bytes], say: Print) -> None:
    """A .py beside its .mpy would be imported in its place."""
    modules = {path.rpartition(".")[0] for path in wanted}
    for path in stale:
        transport.fs_rmfile(path)
        if path.rpartition(".")[0] not in modules:
            say(f"removed: {path[1:]} is no longer part")


def _check_room(
    transport: SerialTransport, changed: dict[str, bytes], present: dict[str, tuple[int, bytes]]
) -> None:
    """Refuse before anything is touched. littlefs keeps whole blocks, and an old file until the new is in."""
    block, free_blocks = transport.eval("(lambda s: (s[0], s[3]))(__import__('os').statvfs('/'))")
    blocks = sum(-(-len(data) // block) + (path not in present) for path, data in changed.items())
    if blocks > free_blocks:
        raise InputError(
            f"not enough room on the board: {blocks * block // 1000} kB needed, "
            f"{free_blocks * block // 1000} kB free: remove files of your own from it"
        )


def _copy(transport: SerialTransport, files: dict[str, bytes]) -> None:
    with Bar("copying", sum(len(data) for data in files.values())) as bar:
        for path, data in files.items():
            bar.describe(f"copying {path[1:]}")
            done = 0

            def moved(written: int, _total: int) -> None:
                nonlocal done
                bar.advance(written - done)
                done = written

            transport.fs_writefile(path, data, chunk_size=_CHUNK, progress_callback=moved)


def _last_line(text: str) -> str:
    return text.strip().rpartition("\n")[2].strip() or "an error without words"
