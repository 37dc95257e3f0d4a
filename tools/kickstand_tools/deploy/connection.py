"""Connects to the raw prompt of a board with mpremote, runs programs there, and explains errors of the connection."""

import ast
import contextlib
import errno
import io
import math
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, cast

import serial
from mpremote.transport import TransportError, TransportExecError
from mpremote.transport_serial import SerialTransport
from serial.tools import list_ports

from ..common.messages import InputError, Message, Remedy, cause

# A function that is called with the current action, the number of finished bytes and the number of all bytes
Progress = Callable[[str, int, int], None]

MOST_BYTES = 1_000_000  # longest answer in bytes, a hundred times the list of a board's files
_HEARD_BYTES = 3000
ANSWER_S = 10
_STARTING_S = 3  # a starting board ignores input for up to this time
_POLL_S = 0.01
_PROGRAM_S = 60  # longest run time of a program; long, because an emulated board compiles the modules slowly
_EMULATED = "socket:"  # the name of an emulated board's port starts with this
_SLOWER = 12  # factor on time limits for an emulated board, which is slow on a busy computer
RETURN_S = 6  # longest wait for a port that is missing or in use, because a board restarts or has just been plugged in
_RETURN_POLL_S = 0.25
RESTART_S = 2  # time to wait until the board's USB port is back, because the next command may follow at once

# The protocol of the raw prompt, and the limits of printed_lines()
_CTRL_A, _CTRL_C = b"\x01", b"\x03"
_END = b"\x04"  # the board sends this after the program's output, and again after its error
_PROMPT = b">"  # the board sends this after output and error
_LAST_S = 10.0  # the program's output may continue for this time after Ctrl-C
_LONGEST_LINE = 100_000  # largest number of bytes in a line. The lines of rides have 2,000
_AWAY_S = 1.0  # a streaming board stops if the computer reads nothing for longer, as when the computer sleeps
_AWAY_SILENT_S = 5.0  # longest silence of the board after the computer read nothing for _AWAY_S

# USB vendors of the boards themselves and of the serial chips on ESP32 boards
VENDORS = {
    0x2E8A: "Raspberry Pi",
    0x303A: "Espressif",
    0xF055: "MicroPython",
    0x10C4: "Silicon Labs CP210x",
    0x1A86: "WCH CH340",
    0x0403: "FTDI",
}
_DEBUG_PROBE = (0x2E8A, 0x000C)  # Raspberry Pi's Debug Probe is not a board

UPDATE = Remedy("kickstand flash brings it up to date", "the page Install brings it up to date")


class ConnectionLost(Message):
    """The connection to a port was lost. A page has only one port, and the browser gives no cause."""

    name: str
    cause: str

    text = "{name}: connection lost ({cause})"
    todo = Remedy("plug the board in again, then repeat")

    def line(self, page: bool = False) -> str:
        """See Message."""
        return f"connection lost: {self.todo.words(page)}" if page else super().line()


class ConnectedBoard(SerialTransport):
    """A connection to a board that limits the length of answers. mpremote alone reads as long as bytes arrive."""

    slower = 1  # factor on mpremote's timeouts, for a board that runs slower than real time
    heard = b""  # the last bytes of the board's output

    def wait(self, seconds: float) -> None:
        """Sleep. A program that must not sleep overrides this method in a subclass."""
        time.sleep(seconds)

    def read_until(self, min_num_bytes, ending, timeout=10, data_consumer=None, timeout_overall=None):
        """Read until the ending, as SerialTransport does. Raises TransportError for an answer of over MOST_BYTES."""
        received, serial = bytearray(), cast(Any, self.serial)
        began_s = heard_s = time.monotonic()
        silent_s, overall_s = (math.inf if s is None else s * self.slower for s in (timeout, timeout_overall))
        while not received.endswith(ending):
            now_s = time.monotonic()
            # An emulator's pseudo-terminal may not report waiting bytes. Older versions of mpremote lack is_pty.
            if piece := serial.read(1) if getattr(self, "is_pty", False) or serial.inWaiting() > 0 else b"":
                received += piece
                self.heard = (self.heard + piece)[-_HEARD_BYTES:]
                heard_s = now_s
                if len(received) > MOST_BYTES:
                    raise TransportError("the answer does not end")
                if data_consumer:
                    data_consumer(piece)
            elif now_s >= heard_s + silent_s or now_s >= began_s + overall_s:
                break
            else:
                self.wait(_POLL_S)
        return bytes(received)


class _EmulatedBoard(ConnectedBoard):
    slower = _SLOWER


# The name of a port, an open connection to a board, or None for the only board that is plugged in
Port = str | ConnectedBoard | None


@contextlib.contextmanager
def connected(
    port: Port, before: Callable[[ConnectedBoard], None] | None = None
) -> Iterator[tuple[ConnectedBoard, str]]:
    """A context that yields a board at its raw prompt, and the name of its port. The board's program is interrupted.

    Errors of the connection, also inside the with block, are raised as InputError.

    before: called before the soft reset, which removes all modules, if the board answers. It may raise TransportError.
    """
    if port is None or isinstance(port, str):
        name = port or find_port()
        transport = _open_board(name)
    else:
        transport, name = port, port.device_name
    try:
        _enter_raw_prompt(transport, name, before)
        yield transport, name
    except TransportExecError as error:
        reason = last_line(error.error_output)
        if damaged(reason):
            raise _damaged_files(name, f" ({reason})") from error
        raise InputError(f"{name}: the board reports {reason}: try again") from error
    except TransportError as error:
        raise InputError(f"{name}: the board stopped answering: plug it in again, then repeat this") from error
    except OSError as error:
        if error.filename is not None:  # an error about a file on this computer
            raise InputError(f"{error.filename}: {cause(error)}: check the disk or the file, then repeat") from error
        if error.errno == errno.ENOSPC:
            raise InputError(f"the board at {name} is full: remove files of your own from it") from error
        if error.errno in (errno.EILSEQ, 84, 52):  # an error on the board, which mpremote raises as its own
            raise _damaged_files(name) from error
        raise InputError(ConnectionLost(name, cause(error))) from error
    finally:
        with contextlib.suppress(OSError):
            transport.close()  # this fails if the port has disappeared or restarts


def _open_board(name: str) -> ConnectedBoard:
    """Open a port. After a restart, a board may need some seconds. Raises InputError with the reason."""
    kind = _EmulatedBoard if name.startswith(_EMULATED) else ConnectedBoard
    until_s = time.monotonic() + (0 if kind is _EmulatedBoard else RETURN_S)
    while True:
        try:
            return kind(name, timeout=ANSWER_S * (_SLOWER if kind is _EmulatedBoard else 1))
        except TransportError:
            refusal = why_closed(name)
            if not isinstance(refusal, MayPass) or time.monotonic() >= until_s:
                raise refusal from None
            time.sleep(_RETURN_POLL_S)
        except ValueError:
            raise why_closed(name) from None


def find_port() -> str:
    """Return the port of the only board that is plugged in. Raises InputError for no board, and for several boards."""
    until_s = time.monotonic() + RETURN_S  # the board may be restarting
    while not (ports := [p for p in list_ports.comports() if p.vid in VENDORS and (p.vid, p.pid) != _DEBUG_PROBE]):
        if time.monotonic() >= until_s:
            break
        time.sleep(_RETURN_POLL_S)
    if not ports:
        plug_in = "plug it in with a USB cable that carries data, put MicroPython on it if it is new, or name its port "
        raise InputError("no board found", Remedy(plug_in + "with --port"))
    if len(ports) > 1:
        names = ", ".join(f"{p.device} ({VENDORS[p.vid]})" for p in sorted(ports, key=lambda p: p.device))
        raise InputError(f"several boards found: {names}", Remedy("name one with --port"))
    return ports[0].device


class MayPass(InputError):
    """A reason why a port cannot be opened that may pass within seconds."""


def why_closed(port: str) -> InputError:
    """Return an error that explains why a port cannot be opened. Opens the port again to find the reason."""
    try:
        serial.serial_for_url(port, timeout=1, exclusive=True).close()
    except ValueError as error:
        return InputError(f"{port} is not a port: {cause(error)}")
    except OSError as error:
        text = str(error)
        # On Windows, the text contains PermissionError
        if error.errno in (errno.EBUSY, errno.EAGAIN) or "PermissionError" in text:
            remedy = (
                "close the other program that has it open; on Linux ModemManager may hold a new port for half a minute"
            )
            return MayPass(f"{port} is in use", Remedy(remedy))
        if error.errno in (errno.EACCES, errno.EPERM):
            return InputError(f"no permission for {port}: on Linux join the group dialout and log in again")
        if error.errno == errno.ENOENT or "FileNotFoundError" in text:
            remedy = Remedy("plug the board in, or leave out --port to find it automatically")
            return MayPass(f"there is no port {port}", remedy)
        if port.startswith("socket:") and "refused" in text:
            return InputError(f"nothing listens at {port}", Remedy("is kickstand emulate running?"))
        return InputError(f"{port} cannot be opened: {text}: check the name and the cable")
    return MayPass(f"{port} could not be opened at first, but now it can: try again")


def restart(transport: ConnectedBoard) -> None:
    """Reset the board, which then starts as after power-on. Its USB port disappears for a moment."""
    transport.exec_raw_no_follow("import time, machine\ntime.sleep_ms(100)\nmachine.reset()")
    transport.wait(RESTART_S)


def ask(transport: SerialTransport, expression: str, *shapes: Any) -> Any:
    """Evaluate a Python expression on the board. shapes: see literal(). Raises InputError."""
    return literal(transport.exec(f"print(repr({expression}))"), *shapes)


def literal(text: bytes, *shapes: Any) -> Any:
    """Convert a line of a board's output to a Python value.

    shapes: the allowed types. Each is a type, or None, or a tuple with the types of a tuple's values. Integers must be
        0 or larger.
    Raises InputError for other values, which another device at the port may send.

    >>> literal(b"('/rides', 3)", (str, int))
    ('/rides', 3)
    """
    try:
        value = ast.literal_eval(text.decode().strip())
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError):
        value = literal  # not a literal, so it matches none of the shapes
    if any(_fits(value, shape) for shape in shapes):
        return value
    excerpt = ascii(text[:40].decode(errors="replace").strip())
    raise InputError(f"the board's answer {excerpt} makes no sense: plug it in again, then repeat this")


def _fits(value: Any, shape: Any) -> bool:
    if isinstance(shape, tuple):
        return type(value) is tuple and len(value) == len(shape) and all(map(_fits, value, shape))
    return value is None if shape is None else type(value) is shape and (shape is not int or 0 <= value < 1 << 40)


def describe(transport: SerialTransport, name: str) -> str:
    """Return the board's name and its version of MicroPython. Raises InputError if the board runs another Python."""
    implementation, version, machine = ask(
        transport,
        "(lambda i: (i.name, '.'.join(str(n) for n in i.version[:3]), getattr(i, '_machine', 'board')))"
        "(__import__('sys').implementation)",
        (str, str, str),
    )
    if implementation != "micropython":
        raise InputError(f"{name} runs {implementation}: put MicroPython on the board first")
    return f"{machine}, MicroPython {version}"


def printed(transport: SerialTransport, name: str, code: str, what: str) -> bytes:
    """Run a program that uses the firmware, and return its output. Raises InputError if it fails on the board.

    what: name of the output, for messages.
    """
    output, error = transport.exec_raw(code, timeout=_PROGRAM_S)
    if error:
        reason = last_line(error.decode(errors="replace"))
        refused = any(name in reason for name in ("Refusal", "SettingsError", "CardError"))  # up to 0.4.0 CardError
        if damaged(reason) and not refused:
            raise _damaged_files(name, f" ({reason})")
        if refused:
            raise InputError(f"{name}: {reason.partition(': ')[2]}")
        refuse_unfit_firmware(reason, name)
        raise InputError(f"the board at {name} cannot give {what} ({reason})", UPDATE)
    return output


class BrokenOff(Exception):
    """The program has ended with an error, or has stopped printing. The text gives the reason."""


def printed_lines(
    transport: ConnectedBoard,
    code: str,
    silent_s: float,
    stopped: threading.Event | None = None,
    most_bytes: float = math.inf,
) -> Iterator[bytes]:
    """Run code on the board, and yield each line that it prints, without the line end, while the code runs.

    silent_s: longest time without output.
    stopped: event that, when set, sends Ctrl-C to the program.
    most_bytes: largest number of bytes of output.
    Raises BrokenOff if the program fails or exceeds a limit, and OSError if the connection fails.
    """
    transport.exec_raw_no_follow(code)
    serial: Any = transport.serial
    received, count = b"", 0
    asked_s = None
    heard_s = time.monotonic()
    away_s, polled_s = 0.0, time.time()  # unlike the monotonic clock, time.time() continues while the computer sleeps
    while received.count(_END) < 2 or not received.endswith(_PROMPT):
        if stopped and stopped.is_set() and asked_s is None:
            asked_s = time.monotonic()
            serial.write(_CTRL_C)
        away_s, polled_s = max(away_s, time.time() - polled_s), time.time()
        if waiting := serial.inWaiting():
            heard_s = time.monotonic()
            got = serial.read(waiting)
            received, count = received + got, count + len(got)
            if count > most_bytes or len(received) > _LONGEST_LINE + len(got):
                raise BrokenOff("the program on the board does not end")
        elif time.monotonic() - heard_s > silent_s:
            raise BrokenOff("the board says nothing any more")
        elif away_s > _AWAY_S and time.monotonic() - heard_s > min(silent_s, _AWAY_SILENT_S):
            raise BrokenOff(f"the board stopped because this computer took nothing for {away_s:.0f} s: keep it awake")
        elif asked_s is not None and time.monotonic() - asked_s > _LAST_S:
            return
        else:
            transport.wait(_POLL_S)
        # The last line is not whole yet, and what follows the end of the output is no line of it
        output, end, error = received.partition(_END)
        *complete, output = output.split(b"\n")
        received = output + end + error
        for line in complete:
            yield line.strip()
    # Let the board print its prompt again. mpremote waits for the prompt, which this function has already read
    serial.write(_CTRL_A)
    error = received.split(_END)[1].decode(errors="replace").strip()
    if error and asked_s is None:
        raise BrokenOff(f"the board reports {last_line(error)}")


def refuse_unfit_firmware(reason: str, name: str) -> None:
    """Raise InputError if an exception on the board means that Kickstand or one of its modules is missing.

    Modules are missing in another version of the firmware, and after an interrupted update.
    """
    if "no module named 'kickstand'" in reason:
        install = Remedy("install it with kickstand flash", "install it with the page Install")
        raise InputError(f"Kickstand is not on the board at {name}", install)
    missing = reason.partition("ImportError: ")[2]
    if "kickstand" in missing:
        raise InputError(f"the firmware on the board at {name} is of another version or not whole ({missing})", UPDATE)


def last_line(text: str) -> str:
    """Return the exception at the end of a traceback."""
    return text.strip().rpartition("\n")[2].strip() or "an unknown error"


def _enter_raw_prompt(
    transport: ConnectedBoard, name: str, before: Callable[[ConnectedBoard], None] | None = None
) -> None:
    """Send Ctrl-C, then a soft reset into the raw prompt, which does not start main.py. before: see connected()."""
    for limit_s in (_STARTING_S, ANSWER_S):  # a board may reset when its port is opened, and then needs time to start
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # mpremote prints output that it cannot interpret
                if before:
                    transport.enter_raw_repl(soft_reset=False, timeout_overall=limit_s)
                    with contextlib.suppress(TransportError, InputError):
                        before(transport)
                transport.enter_raw_repl(timeout_overall=limit_s)
            return
        except TransportError:
            if limit_s == ANSWER_S:
                raise _why_silent(name, getattr(transport, "heard", b"")) from None


_NUKE = (
    "on a Pico with https://datasheets.raspberrypi.com/soft/flash_nuke.uf2, on an ESP32 with esptool erase-flash "
    "(https://docs.espressif.com/projects/esptool), then put MicroPython on it again"
)
# Messages of MicroPython (inisetup.py of the ESP32), of littlefs and of the flash. 84 is EILSEQ and LFS_ERR_CORRUPT
_CORRUPT = ("filesystem appears to be corrupted", "EILSEQ", "] EIO", "Errno 84", "Errno 52")
_WATCHDOG = ("wdt", "watchdog", "rst:0x")
_CRASHES = ("guru meditation", "fatal python error", "abort() was called", "fatal error", "panic", "stack smashing")
_LONGEST_WORDS = 60  # longest part of the board's output in a message, characters


def _damaged_files(name: str, reason: str = "") -> InputError:
    return InputError(f"{name}: the board's file system is damaged{reason}: erase its flash: {_NUKE}")


def _why_silent(name: str, heard: bytes) -> InputError:
    """Return the error for a board that does not show its prompt. heard: the last bytes of the board's output."""
    text = heard.decode(errors="replace")
    if damaged(text):
        return InputError(f"{name}: the board says that its file system is damaged: erase its flash: {_NUKE}")
    last = next((line.strip() for line in reversed(text.splitlines()) if line.strip().strip("\0\ufffd>")), "")
    words = f"the board prints {last[:_LONGEST_WORDS]!a}: " if last else ""
    button = "hold the push button that is wired to it (not BOOTSEL or BOOT) while plugging it in"
    if any(mark in text.lower() for mark in _CRASHES):
        words += "MicroPython on the board crashes: erase its flash"
    elif any(mark in text.lower() for mark in _WATCHDOG):
        words += "a watchdog of the program on it restarts it again and again: try again at once, and if it stays so "
        words += "erase its flash"
    elif words:
        words += f"a program on it does not let go: if that is Kickstand {button}; else erase its flash"
    else:
        return InputError(
            f"no MicroPython answers on {name}: check that this is the board's port, put MicroPython on it, or "
            f"{button}; a program of another project that does not let go is removed with the flash: {_NUKE}"
        )
    return InputError(f"{name}: {words}: {_NUKE}")


def damaged(text: str) -> bool:
    """True if a board's message means that its file system is damaged."""
    return any(mark in text for mark in _CORRUPT)
