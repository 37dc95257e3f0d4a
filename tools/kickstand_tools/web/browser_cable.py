"""Runs `kickstand record` and `kickstand pull` in the browser, on CPython for WebAssembly.

page/live/live.mjs calls this module. Files are returned as bytes, all other results as JSON.
"""

import contextlib
import io
import json
import tempfile
import threading
from datetime import datetime
from pathlib import Path

from ..calibration.file import calibration_path, write_calibration
from ..common.messages import InputError
from ..deploy.connection import connected, describe, restart
from ..rides import pull as pulling, ride_log, stream
from .browser_serial import BrowserBoard


class LiveStream:
    """Receives a board's stream and keeps it as a log."""

    def __init__(self):
        self._stopped = threading.Event()
        self._log = io.StringIO()
        self._recording = None
        self._began = datetime.now()

    def run(self, line, name, live):
        """Receive the stream until stop() is called or no more data arrives. Then files() returns the log.

        line: the board's SerialLine. name: name of the port.
        live: called every half second with the fields of a LiveReading as JSON.
        Returns JSON: {"refused": reason}, or {"notes": lines about missing parts, "changed": true if the board's
        calibration changed}.
        """
        self._recording = stream.StreamLog(self._stopped, lambda reading: live(json.dumps(vars(reading))))
        notes = []
        try:
            with connected(BrowserBoard(line, name)) as (transport, _):
                try:
                    describe(transport, name)
                    blocks = stream.blocks(transport, "", notes, self._stopped)
                    self._recording.write(self._log, blocks, notes)
                finally:
                    with contextlib.suppress(Exception):  # the cable may be unplugged
                        restart(transport)
        except InputError as error:
            return json.dumps({"refused": error.line(page=True)})
        return json.dumps({"notes": notes, "changed": stream.CHANGED in notes})

    def stop(self):
        """End run()."""
        self._stopped.set()

    def files(self):
        """Return [(name, content)] of the log and its calibration, as `kickstand record` writes them. Empty before the
        first readings.
        """
        first = self._recording and self._recording.first
        if not first:
            return []
        calibration = io.StringIO()
        write_calibration(calibration, ride_log.calibration(first))
        stem = f"live-{self._began:%Y%m%d-%H%M%S}-{first.crc & 0xFFFF:04x}"
        contents = {f"{stem}.csv": self._log, f"{stem}.cal.json": calibration}
        return [(name, file.getvalue().encode("ascii")) for name, file in contents.items()]


def pull(line, name, progress):
    """Fetch the rides from the board at a SerialLine. progress: called with (what, done, total), in bytes.

    Returns:
        result: JSON of {"refused": the reason for an early end, or null, "rides": the fields of each PulledRide}.
        The field "log" is the file's name.
        files: [(name, content)] of the logs and their calibrations, as `kickstand pull` writes them.
    """
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
