"""`kickstand flash`, `status` and `check` in the browser: their own code on CPython for WebAssembly.
page/install/install.mjs runs it. Results are JSON.
"""

import json
import re
import sys
from pathlib import Path

from ..common import firmware_path
from ..common.errors import InputError
from ..deploy import bytecode, check as board_check, config_check, config_text, connection, flash, others
from ..deploy.firmware_files import CONFIG
from .serial_guest import BrowserBoard

OLDEST = (1, 23)  # MicroPython
PLATFORMS = ("rp2", "esp32")
ROOT = Path("/packages")  # where page/python.mjs unpacks archives.install_archive()
COMMON = "armv6m"  # the first of archives.ARCHITECTURES
_VERSION = "(lambda s: (tuple(s.implementation.version[:2]), s.platform))(__import__('sys'))"
_POSE = "(lambda s: (s.platform, getattr(s.implementation, '_machine', '')))(__import__('sys'))"


class Installation:
    """One board. Call look() first, then install(); call check() any time between."""

    def look(self, line, name):
        """Identify the board at a SerialLine, and read its config.py. name: the port's name, for messages. The board is
        restarted.

        Returns {"refused": reason} or {"board", "settings": {name: value in config.py}, "usual": {name: default value},
        "by_hand": the reason why a form cannot change this config.py, or null, "others": one line per file of another
        project that install() will rename}.
        """
        try:
            with connection.connected(BrowserBoard(line, name)) as (transport, name):
                try:
                    board = _describe(transport, name)
                    self._pose = transport.eval(_POSE)
                    there = others.read(transport)
                finally:
                    connection.restart(transport)
        except InputError as error:
            return json.dumps({"refused": error.line(page=True)})
        self._path = firmware_path.config()
        self._template = self._path.read_text(encoding="utf-8")
        for module in [module for module in sys.modules if module.startswith("kickstand.")]:
            del sys.modules[module]  # imported for an earlier board: the firmware identifies its board on import
        settings, self._by_hand, self._own = {}, None, None
        found = others.find(there, lambda path: _judged(path, *self._pose), True)
        own = None if CONFIG in found.moves else there.texts.get(CONFIG)
        try:
            self._own = None if own is None else config_text.decoded(own)
            settings = config_text.values(self._own or "")
        except InputError as error:
            self._by_hand = str(error)
        with config_check.posed(*self._pose):
            usual = {
                name: _written(value) for name, value in vars(config_check.default_settings()).items() if name.isupper()
            }
        said = {"board": board, "settings": settings, "usual": usual, "by_hand": self._by_hand}
        return json.dumps(said | {"others": found.words()})

    def check(self, wanted):
        """Check the config.py with these settings, {name: value or null for the default}, by the firmware's own rules.
        Returns {"text", "fault": [name of the setting or null, reason] or null}.
        """
        text = self._template if self._own is None else self._own
        values = json.loads(wanted)
        for name, value in values.items():  # one by one, because a fault is shown beside its field
            try:
                text = config_text.with_values(text, {name: value})
            except InputError as error:
                return json.dumps({"text": text, "fault": [name, str(error)]})
        self._path.write_text(text, encoding="utf-8")
        with config_check.posed(*self._pose):
            found = config_check.fault(self._path)
        if found:
            line, reason = found
            setting = line and re.match(r"\w+", config_text.lines(text)[line - 1])
            mentioned = next((name for name in values if re.search(rf"\b{name}\b", reason)), None)
            found = [setting[0] if setting else mentioned, reason.partition(": correct it")[0]]
        return json.dumps({"text": text, "fault": found})

    def install(self, line, name, wanted, progress):
        """Install the firmware on the board at a SerialLine, with the settings that check() accepted. A config.py that
        a form cannot change is kept. progress(what, done, total): the progress, bytes.

        Returns {"board", "copied": number of files, "kept": number of files, "config_kept"} or {"refused": reason}.
        """
        self._path.write_text(self._template, encoding="utf-8")
        text = None if self._by_hand else json.loads(self.check(wanted))["text"]
        try:
            replaces = text is not None and text != self._own
            board = BrowserBoard(line, name)
            done = flash.flash(board, replaces, progress, describe=_describe, compiler=_compiled, judge=_judged)
        except InputError as error:
            return json.dumps({"refused": error.line(page=True)})
        installed = done.installed
        counts = {"copied": len(installed.copied), "kept": len(installed.kept)}
        return json.dumps({"board": done.board, "config_kept": CONFIG not in installed.copied} | counts)


def status(line, name):
    """The output of `kickstand status` for the board at a SerialLine: {"text"} or {"refused": reason}."""
    try:
        return json.dumps({"text": connection.status(BrowserBoard(line, name))})
    except InputError as error:
        return json.dumps({"refused": error.line(page=True)})


def check(line, name, say):
    """Run `kickstand check` on the board at a SerialLine: {"text"} or {"refused": reason}. say(text): called with each
    line."""
    try:
        checked = board_check.check(BrowserBoard(line, name), say)
    except InputError as error:
        return json.dumps({"refused": error.line(page=True)})
    lines = [board_check.line(finding) for finding in checked.findings]
    return json.dumps({"text": "\n".join([*lines, board_check.verdict(checked.findings)])})


def _describe(transport, name):
    """connection.describe(), which also refuses boards that Kickstand does not run on."""
    text = connection.describe(transport, name)
    version, platform = transport.eval(_VERSION)
    if version < OLDEST:
        raise InputError(f"{text}: put MicroPython {OLDEST[0]}.{OLDEST[1]} or newer on the board first")
    if platform not in PLATFORMS:
        raise InputError(f"{text}: Kickstand runs on a Raspberry Pi Pico and on an ESP32")
    return text


def _written(value):
    """The value as written in config.py: addresses in hexadecimal."""
    return f"({', '.join(map(hex, value))})" if isinstance(value, tuple) else repr(value)


def _compiled(source, architecture):
    """bytecode.cross_compiled() from the archive. Everything except machine code is the same for every board."""
    folders = [ROOT / "compiled" / one for one in (architecture, COMMON)]
    path = source.relative_to(firmware_path.PACKAGE).with_suffix(".mpy")
    if not folders[0].is_dir():
        raise bytecode.CannotCompile("this page has nothing compiled for this board")
    return next(folder / path for folder in folders if (folder / path).is_file()).read_bytes()


def _judged(path, platform, machine):
    """Run config_check.judge() in this process."""
    with config_check.posed(platform, machine):
        return config_check.in_words(path, config_check.fault(path), config_check.unused(path, platform))
