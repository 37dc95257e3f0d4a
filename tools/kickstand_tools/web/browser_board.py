"""Runs `kickstand flash`, `status`, `check`, `record` and `pull` in the browser, on CPython for WebAssembly.

page/install/install.mjs and page/live/live.mjs call this module. The page keeps running while this module waits for the
board. A result is JSON, except files, which are bytes. If the board or the input cannot be used, the result is
{"refused": reason}, worded for a page.

line: in all functions, the board's SerialLine of cable.mjs.
name: in all functions, the name of the port, for messages.
"""

import contextlib
import functools
import io
import json
import re
import sys
import tempfile
import threading
import time
from datetime import datetime
from pathlib import Path

from pyodide.ffi import run_sync  # waits for a JavaScript promise

from ..common import installation
from ..common.messages import InputError
from ..deploy import check as board_check, config_file, flash, status as board_status, update
from ..deploy.connection import ANSWER_S, ConnectedBoard, connected, describe, restart
from ..deploy.firmware_files import CONFIG, CannotCompile

ROOT = Path("/packages")  # where page/python.mjs unpacks archives.install_archive()
COMMON = "armv6m"  # the first of archives.ARCHITECTURES
_POLL_S = 0.002
_GONE = "nothing comes any more"


class Port:
    """The part of pyserial's Serial that mpremote uses."""

    dtr = rts = True

    def __init__(self, line):
        self._line = line
        self._received = bytearray()

    def inWaiting(self):
        if not self._received:
            self._listen()
        return len(self._received)

    def read(self, size=1):
        """Read `size` bytes. After ANSWER_S, return the bytes received so far."""
        until_s = time.monotonic() + ANSWER_S
        while len(self._received) < size and time.monotonic() < until_s:
            self._listen()
            if len(self._received) < size:
                self.sleep(_POLL_S)
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    def _listen(self):
        self._received += self._line.take().to_py()
        if self._line.lost and not self._received:
            raise OSError(5, _GONE)

    def write(self, data):
        if not run_sync(self._line.send(bytes(data))):
            raise OSError(5, _GONE)
        return len(data)

    def close(self):
        run_sync(self._line.close())

    def sleep(self, seconds):
        run_sync(self._line.sleep(1000 * seconds))


class BrowserBoard(ConnectedBoard):
    def __init__(self, line, name):
        self.serial, self.device_name = Port(line), name
        self.in_raw_repl, self.use_raw_paste, self.mounted, self.is_pty = False, True, False, False

    def wait(self, seconds):
        self.serial.sleep(seconds)  # time.sleep() would stop the whole page


def in_json(function):
    """A decorator: return the result as JSON, or the reason for a refusal."""

    @functools.wraps(function)
    def as_json(*arguments):
        try:
            return json.dumps(function(*arguments))
        except InputError as error:
            return json.dumps({"refused": error.line(page=True)})

    return as_json


class Installation:
    """The installation on one board. Call look() first, then check() as often as needed, then install()."""

    @in_json
    def look(self, line, name):
        """Identify the board, read its config.py, and restart the board.

        Returns:
            board: the board in words.
            settings, usual: {name: value} of config.py and of the defaults.
            by_hand: the reason why the form cannot change this config.py, or null.
            others: one line per file of another project that install() will rename.
        """
        with connected(BrowserBoard(line, name)) as (transport, _):
            try:
                board = flash.describe_supported(transport, name)
                self._identity = flash.platform_and_machine(transport)
                files = update.read_contents(transport)
            finally:
                restart(transport)
        self._path = installation.config()
        self._template = self._path.read_text(encoding="utf-8")
        for module in [module for module in sys.modules if module.startswith("kickstand.")]:
            del sys.modules[module]  # the firmware identifies its board at import, so import it again
        settings, self._by_hand, self._own = {}, None, None
        others = update.find_others(files, lambda path: config_file.judge_here(path, *self._identity), True)
        config = None if CONFIG in others.moves else files.texts.get(CONFIG)
        try:
            self._own = None if config is None else config_file.cleaned(config).decode()
            settings = config_file.values(self._own or "")
        except InputError as error:
            self._by_hand = str(error)
        with config_file.posed(*self._identity):
            defaults = vars(config_file.default_settings())
            usual = {name: _written(value) for name, value in defaults.items() if name.isupper()}
        described = {"board": board, "settings": settings, "usual": usual, "by_hand": self._by_hand}
        return described | {"others": others.words()}

    @in_json
    def check(self, settings):
        """Check the config.py with new settings by the firmware's own rules.

        settings: JSON of {name: value, or null for the default}.
        Returns the new config.py as "text", and as "fault" [name of the setting or null, reason], or null.
        """
        text, fault = self._checked(json.loads(settings))
        return {"text": text, "fault": fault}

    def _checked(self, values):
        """Return the new config.py and its fault, as in check()."""
        text = self._template if self._own is None else self._own
        for name, value in values.items():  # separately, because the page shows a fault beside its field
            try:
                text = config_file.with_values(text, {name: value})
            except InputError as error:
                return text, [name, str(error)]
        self._path.write_text(text, encoding="utf-8")
        with config_file.posed(*self._identity):
            fault = config_file.fault(self._path)
        if fault:
            line, reason = fault
            setting = line and re.match(r"\w+", config_file.lines(text)[line - 1])
            mentioned = next((name for name in values if re.search(rf"\b{name}\b", reason)), None)
            fault = [setting[0] if setting else mentioned, reason.partition(": correct it")[0]]
        return text, fault

    @in_json
    def install(self, line, name, wanted, progress):
        """Install the firmware on the board. A config.py that the form cannot change is kept.

        wanted: the settings that check() accepted, in the same form.
        progress: called with (what, done, total), in bytes.
        Returns:
            board: the board in words.
            copied: number of files that were copied.
            kept: number of files that were already on the board.
            config_kept: true if the board's config.py was not replaced.
        """
        self._path.write_text(self._template, encoding="utf-8")
        text = None if self._by_hand else self._checked(json.loads(wanted))[0]
        replaces = text is not None and text != self._own
        board = BrowserBoard(line, name)
        result = flash.flash(board, replaces, progress, compiler=_compiled, judge=config_file.judge_here)
        counts = {"copied": len(result.update.copy), "kept": len(result.update.keep)}
        return {"board": result.board, "config_kept": CONFIG not in result.update.copy} | counts


def _written(value):
    """Return the value as written in config.py, with addresses in hexadecimal."""
    return f"({', '.join(map(hex, value))})" if isinstance(value, tuple) else repr(value)


def _compiled(source, architecture):
    """Read a compiled file from the archive. Only files with machine code differ between the boards."""
    own, common = (ROOT / "compiled" / name for name in (architecture, COMMON))
    path = source.relative_to(installation.PACKAGE).with_suffix(".mpy")
    if not own.is_dir():
        raise CannotCompile("this page has nothing compiled for this board")
    return (own / path if (own / path).is_file() else common / path).read_bytes()


@in_json
def status(line, name):
    """Run `kickstand status`. Returns its output as "text"."""
    return {"text": board_status.status(BrowserBoard(line, name))}


@in_json
def check(line, name, say):
    """Run `kickstand check`. say: called with each line of text during the check. Returns its output as "text"."""
    checked = board_check.check(BrowserBoard(line, name), say)
    return {"text": "\n".join([*(finding.line for finding in checked.findings), checked.verdict])}


# Rides. Modules that need numpy are imported in the functions, because the page Install has no numpy


class LiveStream:
    """Receives a board's stream and keeps it as a log."""

    def __init__(self):
        self._stopped = threading.Event()
        self._log = io.StringIO()
        self._recording = None
        self._began = datetime.now()

    @in_json
    def run(self, line, name, live):
        """Receive the stream until stop() is called or no more data arrives. Then files() returns the log.

        live: called every half second with the fields of a LiveReading as JSON.
        Returns as "notes" lines about missing parts, and as "changed" true if the board's calibration changed.
        """
        from ..rides import stream

        self._recording = stream.StreamLog(self._stopped, lambda reading: live(json.dumps(vars(reading))))
        notes = []
        with connected(BrowserBoard(line, name)) as (transport, _):
            try:
                describe(transport, name)
                blocks = stream.blocks(transport, "", notes, self._stopped)
                self._recording.write(self._log, blocks, notes)
            finally:
                with contextlib.suppress(Exception):  # the cable may be unplugged
                    restart(transport)
        return {"notes": notes, "changed": stream.CHANGED in notes}

    def stop(self):
        self._stopped.set()

    def files(self):
        """Return [(name, content)] of the log and its calibration. Empty before the first readings."""
        from ..calibration.file import write_calibration
        from ..rides import ride_log

        first = self._recording and self._recording.first
        if not first:
            return []
        calibration = io.StringIO()
        write_calibration(calibration, ride_log.calibration(first))
        stem = f"live-{self._began:%Y%m%d-%H%M%S}-{first.crc & 0xFFFF:04x}"
        contents = {f"{stem}.csv": self._log, f"{stem}.cal.json": calibration}
        return [(name, file.getvalue().encode("ascii")) for name, file in contents.items()]


def pull(line, name, progress):
    """Fetch the rides from the board. progress: called with (what, done, total), in bytes.

    Returns:
        result: JSON of {"refused": the reason for an early end, or null, "rides": the fields of each PulledRide}.
        The field "log" is the file's name.
        files: [(name, content)] of the logs and their calibrations, as `kickstand pull` writes them.
    """
    from ..calibration.file import calibration_path
    from ..rides import pull as pulling

    refused, rides = None, []
    with tempfile.TemporaryDirectory() as directory:
        try:
            pulling.pull(BrowserBoard(line, name), Path(directory), progress=progress, pulled=rides.append)
        except InputError as error:
            refused = error.line(page=True)
        written = [path for ride in rides if ride.log for path in (ride.log, calibration_path(ride.log))]
        files = [(path.name, path.read_bytes()) for path in written]
    entries = [vars(ride) | {"log": ride.log and ride.log.name} for ride in rides]
    return json.dumps({"refused": refused, "rides": entries}), files
