"""Reads the output of a program on the board line by line while the program runs.

mpremote itself can only read single bytes, or all output at the end.
"""

import math
import threading
import time
from collections.abc import Iterator
from typing import Any

from .connection import ConnectedBoard

_CTRL_A, _CTRL_C = b"\x01", b"\x03"
_END = b"\x04"  # the board sends this after the program's output, and again after its error
_PROMPT = b">"  # the board sends this after output and error
_LAST_S = 10.0  # the program's output may continue for this time after Ctrl-C
_POLL_S = 0.01
_LONGEST_LINE = 100_000  # largest number of bytes in a line. The lines of rides have 2,000
_AWAY_S = 1.0  # a streaming board stops if the computer reads nothing for longer, as when the computer sleeps
_AWAY_SILENT_S = 5.0  # longest silence of the board after the computer read nothing for _AWAY_S


class BrokenOff(Exception):
    """The program has ended with an error, or has stopped printing. The text gives the reason."""


def lines(
    transport: ConnectedBoard,
    code: str,
    silent_s: float,
    stopped: threading.Event | None = None,
    most_bytes: float = math.inf,
) -> Iterator[bytes]:
    """Run code on the board, and yield each line that it prints, without the line end.

    silent_s: Longest time without output.
    stopped: Event that, when set, sends Ctrl-C to the program.
    most_bytes: Largest number of bytes of output.

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
        output, end, error = received.partition(_END)
        *whole, output = output.split(b"\n")
        received = output + end + error
        for line in whole:
            yield line.strip()
    # Let the board print its prompt again. mpremote waits for the prompt, which this function has already read
    serial.write(_CTRL_A)
    error = received.split(_END)[1].decode(errors="replace").strip()
    if error and asked_s is None:
        raise BrokenOff(f"the board reports {error.rpartition(chr(10))[2].strip()}")
