"""`kickstand record` and `kickstand pull` in the browser: their own code on CPython for WebAssembly. page/live/live.mjs
runs it. Results are JSON, except files.
"""

import contextlib
import io
import json
import tempfile
import threading
from datetime import datetime
from pathlib import Path

from ..calibration.file import calibration_path, write_calibration
from ..common.errors import InputError
from ..deploy.connection import connected, describe, restart
from ..rides import pull as pulling, ride_log, stream
from .serial_guest import BrowserBoard


class LiveStream:
    """Watches a board's stream and keeps it."""

    def __init__(self):
        self._stopped = threading.Event()
        self._log = io.StringIO()
        self._recording = None
        self._began = datetime.now()

    def run(self, line, name, live):
        """Listen to the board at a SerialLine until stop(), or until nothing more arrives. name: name of the port.
        live(reading): called every half second with a LiveReading's fields as JSON.

        Returns JSON: {"notes": lines about missing parts, "changed": true if the log ended because of another
        calibration} or {"refused": reason}. The data received until then is in files().
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
        """[(name, content)] of the log and of its calibration, both as written by `kickstand record`. Empty before the
        first readings."""
        first = self._recording and self._recording.first
        if not first:
            return []
        calibration = io.StringIO()
        write_calibration(calibration, ride_log.calibration(first))
        stem = f"live-{self._began:%Y%m%d-%H%M%S}-{first.crc & 0xFFFF:04x}"
        made = {f"{stem}.csv": self._log, f"{stem}.cal.json": calibration}
        return [(name, file.getvalue().encode("ascii")) for name, file in made.items()]


def pull(line, name, progress):
    """Fetch the rides from the board at a SerialLine. name: name of the port.  progress(what, done, total): in bytes.

    Returns (JSON, files): {"refused": the reason for an early end, or null, "rides": [a PulledRide's fields, "log" its
    name or null]} and [(name, content)], the logs with their calibrations as written by `kickstand pull`.
    """
    refused, rides = None, []
    with tempfile.TemporaryDirectory() as directory:
        try:
            pulling.pull(BrowserBoard(line, name), Path(directory), progress=progress, pulled=rides.append)
        except InputError as error:
            refused = error.line(page=True)
        written = [path for ride in rides if ride.log for path in (ride.log, calibration_path(ride.log))]
        files = [(path.name, path.read_bytes()) for path in written]
    found = [vars(ride) | {"log": ride.log and ride.log.name} for ride in rides]
    return json.dumps({"refused": refused, "rides": found}), files
