"""`kickstand flash` in the browser: its own code on CPython for WebAssembly. page/install/install.mjs runs it, in a
fresh Python for each board.
"""

import json
import sys
from pathlib import Path

from .serial_port import ROOT, take_place_of_pyserial

OLDEST = (1, 23)  # MicroPython
PLATFORMS = ("rp2", "esp32")
COMMON = "armv6m"  # the first of install_archive.ARCHITECTURES
_POSE = "(lambda s: (tuple(s.implementation.version[:2]), s.platform))(__import__('sys'))"


def install(line, name, side, tell):
    """Put the firmware onto the board at a SerialLine. name: of its port, for messages. side: which way its kickstand
    leans the bike, for a board that has no config.py. tell(what, done, total): the progress, bytes.

    Returns JSON: {"board", "copied": how many files, "kept": likewise, "config_kept"} or {"refused": why}.
    """
    take_place_of_pyserial(line)
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
        folders = [Path(ROOT) / "compiled" / one for one in (architecture, COMMON)]
        path = source.relative_to(firmware_path.PACKAGE).with_suffix(".mpy")
        if not folders[0].is_dir():
            raise bytecode.CannotCompile("this page has nothing compiled for this board")
        return next(folder / path for folder in folders if (folder / path).is_file()).read_bytes()

    def judged(path, platform, machine):
        before = sys.platform
        found = config_check.in_words(path, *config_check.posing(path, platform, machine))
        sys.platform = before
        return found

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


def _choose_right(config):
    """SIDE = "right" in a config.py that leaves it to the default."""
    text = config.read_text(encoding="utf-8")
    config.write_text(text.replace('# SIDE = "left"', 'SIDE = "right"', 1), encoding="utf-8")
