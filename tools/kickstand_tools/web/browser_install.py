"""Runs `kickstand flash`, `status` and `check` in the browser, on CPython for WebAssembly.

page/install/install.mjs calls this module. Results are JSON. If the board cannot be used, the result is
{"refused": reason}.
"""

import json
import re
import sys
from pathlib import Path

from ..common import installation
from ..common.messages import InputError
from ..deploy import (
    bytecode,
    check as board_check,
    config_check,
    config_text,
    connection,
    flash,
    others,
    status as board_status,
)
from ..deploy.firmware_files import CONFIG
from .browser_serial import BrowserBoard

ROOT = Path("/packages")  # where page/python.mjs unpacks archives.install_archive()
COMMON = "armv6m"  # the first of archives.ARCHITECTURES
_POSE = "(lambda s: (s.platform, getattr(s.implementation, '_machine', '')))(__import__('sys'))"


class Installation:
    """The installation on one board. Call look() first, then check() as often as needed, then install()."""

    def look(self, line, name):
        """Identify the board, read its config.py, and restart the board.

        line: the board's SerialLine. name: name of the port.
        Returns {"refused": reason} or:
            board: the board in words.
            settings, usual: {name: value} of config.py and of the defaults.
            by_hand: the reason why the form cannot change this config.py, or null.
            others: one line per file of another project that install() will rename.
        """
        try:
            with connection.connected(BrowserBoard(line, name)) as (transport, name):
                try:
                    board = flash.describe_supported(transport, name)
                    self._pose = transport.eval(_POSE)
                    files = others.read(transport)
                finally:
                    connection.restart(transport)
        except InputError as error:
            return json.dumps({"refused": error.line(page=True)})
        self._path = installation.config()
        self._template = self._path.read_text(encoding="utf-8")
        for module in [module for module in sys.modules if module.startswith("kickstand.")]:
            del sys.modules[module]  # the firmware identifies its board at import, so import it again
        settings, self._by_hand, self._own = {}, None, None
        plan = others.find(files, lambda path: _judged(path, *self._pose), True)
        config = None if CONFIG in plan.moves else files.texts.get(CONFIG)
        try:
            self._own = None if config is None else config_text.cleaned(config).decode()
            settings = config_text.values(self._own or "")
        except InputError as error:
            self._by_hand = str(error)
        with config_check.posed(*self._pose):
            defaults = vars(config_check.default_settings())
            usual = {name: _written(value) for name, value in defaults.items() if name.isupper()}
        described = {"board": board, "settings": settings, "usual": usual, "by_hand": self._by_hand}
        return json.dumps(described | {"others": plan.words()})

    def check(self, settings):
        """Check the config.py with new settings by the firmware's own rules.

        settings: JSON of {name: value, or null for the default}.
        Returns the new config.py as "text", and as "fault" [name of the setting or null, reason], or null.
        """
        text = self._template if self._own is None else self._own
        values = json.loads(settings)
        for name, value in values.items():  # separately, because the page shows a fault beside its field
            try:
                text = config_text.with_values(text, {name: value})
            except InputError as error:
                return json.dumps({"text": text, "fault": [name, str(error)]})
        self._path.write_text(text, encoding="utf-8")
        with config_check.posed(*self._pose):
            fault = config_check.fault(self._path)
        if fault:
            line, reason = fault
            setting = line and re.match(r"\w+", config_text.lines(text)[line - 1])
            mentioned = next((name for name in values if re.search(rf"\b{name}\b", reason)), None)
            fault = [setting[0] if setting else mentioned, reason.partition(": correct it")[0]]
        return json.dumps({"text": text, "fault": fault})

    def install(self, line, name, wanted, progress):
        """Install the firmware on the board. A config.py that the form cannot change is kept.

        line: the SerialLine of the board.
        name: name of the port, for messages.
        wanted: the settings that check() accepted, in the same form.
        progress: function that is called with (what, done, total). The numbers done and total are in bytes.
        Returns {"refused": reason} or:
            board: the board in words.
            copied: number of files that were copied.
            kept: number of files that were already on the board.
            config_kept: true if the board's config.py was not replaced.
        """
        self._path.write_text(self._template, encoding="utf-8")
        text = None if self._by_hand else json.loads(self.check(wanted))["text"]
        try:
            replaces = text is not None and text != self._own
            board = BrowserBoard(line, name)
            result = flash.flash(board, replaces, progress, compiler=_compiled, judge=_judged)
        except InputError as error:
            return json.dumps({"refused": error.line(page=True)})
        counts = {"copied": len(result.update.copy), "kept": len(result.update.keep)}
        return json.dumps({"board": result.board, "config_kept": CONFIG not in result.update.copy} | counts)


def status(line, name):
    """Run `kickstand status` for the board at a SerialLine. Returns {"text": the output} or {"refused": reason}."""
    try:
        return json.dumps({"text": board_status.status(BrowserBoard(line, name))})
    except InputError as error:
        return json.dumps({"refused": error.line(page=True)})


def check(line, name, say):
    """Run `kickstand check` on the board at a SerialLine. Returns {"text": its output} or {"refused": reason}.

    say: called with each line of text during the check.
    """
    try:
        checked = board_check.check(BrowserBoard(line, name), say)
    except InputError as error:
        return json.dumps({"refused": error.line(page=True)})
    lines = [board_check.line(finding) for finding in checked.findings]
    return json.dumps({"text": "\n".join([*lines, board_check.verdict(checked.findings)])})


def _written(value):
    """Return the value as written in config.py, with addresses in hexadecimal."""
    return f"({', '.join(map(hex, value))})" if isinstance(value, tuple) else repr(value)


def _compiled(source, architecture):
    """Read a compiled file from the archive. Only files with machine code differ between the boards."""
    folders = [ROOT / "compiled" / one for one in (architecture, COMMON)]
    path = source.relative_to(installation.PACKAGE).with_suffix(".mpy")
    if not folders[0].is_dir():
        raise bytecode.CannotCompile("this page has nothing compiled for this board")
    return next(folder / path for folder in folders if (folder / path).is_file()).read_bytes()


def _judged(path, platform, machine):
    """Run config_check.judge() in this process."""
    with config_check.posed(platform, machine):
        return config_check.in_words(path, config_check.fault(path), config_check.unused(path, platform))
