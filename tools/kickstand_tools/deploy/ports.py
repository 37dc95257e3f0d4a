"""The serial port that a board is on."""

import errno

import serial
from serial.tools import list_ports

from ..errors import InputError, cause

# USB vendors of the boards themselves and of the serial chips on ESP32 boards
VENDORS = {
    0x2E8A: "Raspberry Pi",
    0x303A: "Espressif",
    0xF055: "MicroPython",
    0x10C4: "Silicon Labs CP210x",
    0x1A86: "WCH CH340",
    0x0403: "FTDI",
}
_DEBUG_PROBE = (0x2E8A, 0x000C)  # of the same vendor, but no board


def find_port() -> str:
    """The port of the only board that is plugged in. Raises InputError for none, or more than one."""
    found = [p for p in list_ports.comports() if p.vid in VENDORS and (p.vid, p.pid) != _DEBUG_PROBE]
    if not found:
        raise InputError(
            "no board found: plug it in with a USB cable that carries data, put MicroPython on it if it is "
            "new, or name its port with --port"
        )
    if len(found) > 1:
        names = ", ".join(f"{p.device} ({VENDORS[p.vid]})" for p in sorted(found, key=lambda p: p.device))
        raise InputError(f"several boards found: {names}: name one with --port")
    return found[0].device


def why_closed(port: str) -> InputError:
    """What is in the way of opening a port, by trying once more."""
    try:
        serial.serial_for_url(port, timeout=1, exclusive=True).close()
    except ValueError as error:
        return InputError(f"{port} is no port: {cause(error)}")
    except OSError as error:
        text = str(error)
        if error.errno in (errno.EBUSY, errno.EAGAIN) or "PermissionError" in text:  # the latter on Windows
            return InputError(f"{port} is in use: close the other program that has it open")
        if error.errno in (errno.EACCES, errno.EPERM):
            return InputError(f"no permission for {port}: on Linux join the group dialout and log in again")
        if error.errno == errno.ENOENT or "FileNotFoundError" in text:
            return InputError(f"there is no port {port}: plug the board in, or leave --port out to have it found")
        if port.startswith("socket:") and "refused" in text:
            return InputError(f"nothing listens at {port}: is kickstand emulate running?")
        return InputError(f"{port} cannot be opened: {text}: check the name and the cable")
    return InputError(f"{port} could not be opened at first, and now can: try again")
