"""`kickstand flash` in the browser: its own code on CPython for WebAssembly, with the browser's serial port in place of
pyserial's. page/install.mjs runs it, in a fresh Python for each board. While it waits the page has the control.
"""

import json
import sys
import time
import types
from pathlib import Path

from pyodide.ffi import run_sync  # waits for what JavaScript promises

ROOT = Path("/kickstand")  # where install_archive.archive() is unpacked
OLDEST = (1, 23)  # MicroPython
PLATFORMS = ("rp2", "esp32")
COMMON = "armv6m"  # the first of install_archive.ARCHITECTURES
_POLL_S = 0.002
_GONE = "nothing comes any more"
_POSE = "(lambda s: (tuple(s.implementation.version[:2]), s.platform))(__import__('sys'))"


class Port:
    """pyserial's Serial, as much of it as mpremote uses. port: the SerialLine of install.mjs."""

    dtr = rts = True

    def __init__(self, port, timeout):
        self._port = port
        self._timeout = timeout
        self._heard = bytearray()

    def isOpen(self):
        return True

    def inWaiting(self):
        if not self._heard:
            self._listen()
        return len(self._heard)

    def read(self, size=1):
        """`size` bytes, or fewer at the time-out."""
        until_s = time.monotonic() + self._timeout
        while len(self._heard) < size and time.monotonic() < until_s:
            self._listen()
            if len(self._heard) < size:
                _sleep(self._port, _POLL_S)
        data = bytes(self._heard[:size])
        del self._heard[:size]
        return data

    def _listen(self):
        self._heard += self._port.take().to_py()
        if self._port.lost and not self._heard:
            raise OSError(5, _GONE)

    def write(self, data):
        if not run_sync(self._port.send(bytes(data))):
            raise OSError(5, _GONE)
        return len(data)

    def close(self):
        run_sync(self._port.close())


def install(port, name, side, tell):
    """Put the firmware onto the board at a SerialLine. name: of its port, for messages. side: which way its kickstand
    leans the bike, for a board that has no config.py. tell(what, done, total): the progress, bytes.

    Returns JSON: {"board", "copied": how many files, "kept": likewise, "config_kept"} or {"refused": why}.
    """
    _take_place_of_pyserial(port)
    from mpremote import transport_serial

    from kickstand_tools import firmware_path
    from kickstand_tools.deploy import bytecode, config_check, connection, flash
    from kickstand_tools.deploy.firmware_files import CONFIG
    from kickstand_tools.errors import InputError

    def described(transport, name):
        """connection.describe(), and a look at whether the board is one that Kickstand runs on."""
        text = connection.describe(transport, name)
        version, platform = transport.eval(_POSE)
        if version < OLDEST:
            raise InputError(f"{text}: put MicroPython {OLDEST[0]}.{OLDEST[1]} or newer on the board first")
        if platform not in PLATFORMS:
            raise InputError(f"{text}: Kickstand runs on a Raspberry Pi Pico and on an ESP32")
        return text

    def compiled(source, architecture):
        """bytecode.cross_compiled() from the archive. All but machine code is the same for every board."""
        folders = ROOT / "compiled" / architecture, ROOT / "compiled" / COMMON
        path = source.relative_to(firmware_path.PACKAGE).with_suffix(".mpy")
        if not folders[0].is_dir():
            raise bytecode.CannotCompile("this page has nothing compiled for this board")
        return next(folder / path for folder in folders if (folder / path).is_file()).read_bytes()

    def judged(path, platform, machine):
        before = sys.platform
        found = config_check.in_words(path, *config_check.posing(path, platform, machine))
        sys.platform = before
        return found

    for module in (transport_serial, connection):  # CPython's own sleep() would stop the whole page
        module.time = types.SimpleNamespace(monotonic=time.monotonic, time=time.time, sleep=lambda s: _sleep(port, s))
    flash.describe, bytecode.cross_compiled, config_check.judge = described, compiled, judged
    if side == "right":
        _choose_right(firmware_path.config())
    try:
        done = flash.flash(name, progress=tell)
    except InputError as error:
        return json.dumps({"refused": str(error)})
    installed = done.installed
    return json.dumps(
        {
            "board": done.board,
            "copied": len(installed.copied),
            "kept": len(installed.kept),
            "config_kept": CONFIG not in installed.copied,
        }
    )


def _take_place_of_pyserial(port):
    """Modules for mpremote to import: it opens serial ports, and asks for a console's properties."""
    names = "serial", "serial.tools", "serial.tools.list_ports"
    serial, tools, list_ports = (types.ModuleType(name) for name in names)
    serial.__version__ = "3.5"
    serial.SerialException = OSError
    serial.serial_for_url = lambda _name, timeout, **_options: Port(port, timeout)
    serial.tools, tools.list_ports = tools, list_ports
    console = types.ModuleType("mpremote.console")
    console.VT_ENABLED = False
    for module in (serial, tools, list_ports, console):
        sys.modules[module.__name__] = module
    sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "firmware"), str(ROOT)]


def _choose_right(config):
    """SIDE = "right" in a config.py that leaves it to the default."""
    text = config.read_text(encoding="utf-8")
    config.write_text(text.replace('# SIDE = "left"', 'SIDE = "right"', 1), encoding="utf-8")


def _sleep(port, seconds):
    run_sync(port.sleep(1000 * seconds))
