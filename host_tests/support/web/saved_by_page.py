"""The files that the page Live offers to save, and the files that `kickstand record` would write."""

import io
import threading

from kickstand_tools.calibration.file import write_calibration
from kickstand_tools.rides import ride_log
from kickstand_tools.rides.stream import StreamLog


def saved(rider, tmp_path):
    """Save all offered files by clicks. Return {name: content}."""
    files = {}
    for link in rider.page.locator("#files a").all():
        with rider.page.expect_download() as download:
            link.click()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        files[path.name] = path.read_bytes()
    return files


def recorded(blocks):
    """Return the contents of the log and the calibration that `kickstand record` writes for these blocks."""
    log, calibration = io.StringIO(), io.StringIO()
    recording = StreamLog(threading.Event())
    recording.write(log, iter(map(ride_log.parse, blocks)), [])
    assert recording.first
    write_calibration(calibration, ride_log.calibration(recording.first))
    return [log.getvalue().encode(), calibration.getvalue().encode()]
