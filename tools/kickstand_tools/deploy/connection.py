"""A connection to a board at its raw prompt, by mpremote, and what its errors mean."""

import contextlib
import errno
import io
import time
from collections.abc import Callable, Iterator
from typing import Any

from mpremote.transport import TransportError, TransportExecError
from mpremote.transport_serial import SerialTransport

from ..errors import InputError, cause
from .ports import find_port, why_closed

# Called with what is being done, the bytes that are done and the bytes in all.
Progress = Callable[[str, int, int], None]

_ANSWER_S = 10
_EMULATED = "socket:"  # begins the name of an emulated board's port
_SLOWER = 12  # how much longer than a board an emulated one may take: its seconds last longer where the host is busy
_RESTART_S = 2  # until the board's USB port is back: the next command may follow at once


class NoFirmware(InputError):
    """Kickstand is not on the board."""


class OutdatedFirmware(InputError):
    """The firmware on the board lacks a module that these tools ask for."""


class _SlowBoard(SerialTransport):
    """A board whose seconds last longer than ours: mpremote's limits on silence are stretched alike."""

    def read_until(self, min_num_bytes, ending, timeout=10, data_consumer=None, timeout_overall=None):
        """See SerialTransport."""
        limits: list[Any] = [limit and limit * _SLOWER for limit in (timeout, timeout_overall)]
        return super().read_until(min_num_bytes, ending, limits[0], data_consumer, limits[1])


@contextlib.contextmanager
def connected(port: str | None) -> Iterator[tuple[SerialTransport, str]]:
    """A board at its raw prompt, its program interrupted, and the name of its port.

    port: None takes the only board that is plugged in.  Raises InputError, also for errors of the connection inside
    the with block.
    """
    name = port or find_port()
    try:
        if name.startswith(_EMULATED):
            transport = _SlowBoard(name, timeout=_ANSWER_S * _SLOWER)
        else:
            transport = SerialTransport(name, timeout=_ANSWER_S)
    except (TransportError, ValueError):
        raise why_closed(name) from None
    try:
        _enter(transport, name)
        yield transport, name
    except TransportExecError as error:
        raise InputError(f"{name}: the board reports {last_line(error.error_output)}: try again") from error
    except TransportError as error:
        raise InputError(f"{name}: the board stopped answering: plug it in again, then repeat this") from error
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise InputError(f"the board at {name} is full: remove files of your own from it") from error
        raise InputError(f"{name}: connection lost ({cause(error)}): plug the board in again, then repeat") from error
    finally:
        with contextlib.suppress(OSError):
            transport.close()  # its port may be gone, or just restarting


def restart(transport: SerialTransport) -> None:
    """Reset the board, so that it starts as after power-on. Its USB port goes away for a moment."""
    transport.exec_raw_no_follow("import time, machine\ntime.sleep_ms(100)\nmachine.reset()")
    time.sleep(_RESTART_S)


def describe(transport: SerialTransport, name: str) -> str:
    """The board and its version of MicroPython. Raises InputError for another Python."""
    implementation, version, machine = transport.eval(
        "(lambda i: (i.name, '.'.join(str(n) for n in i.version[:3]), getattr(i, '_machine', 'board')))"
        "(__import__('sys').implementation)"
    )
    if implementation != "micropython":
        raise InputError(f"{name} runs {implementation}: put MicroPython on the board first")
    return f"{machine}, MicroPython {version}"


def refuse_unfit_firmware(reason: str, name: str) -> None:
    """Raise NoFirmware or OutdatedFirmware if this error of the board at that port says so.

    An update that was broken off lacks modules too.
    """
    if "no module named 'kickstand'" in reason:
        raise NoFirmware(f"Kickstand is not on the board at {name}: kickstand flash puts it there")
    missing = reason.partition("ImportError: ")[2]
    if "kickstand" in missing:
        raise OutdatedFirmware(
            f"the firmware on the board at {name} is of another version or not whole ({missing}): "
            "kickstand flash brings it up to date"
        )


def last_line(text: str) -> str:
    """The exception at the end of a traceback."""
    return text.strip().rpartition("\n")[2].strip() or "an error without words"


def _enter(transport: SerialTransport, name: str) -> None:
    """Ctrl-C, then a soft reset into the raw prompt, which does not start main.py."""
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
