"""The page listens to an emulated Pico and fetches its rides, with the code of `kickstand record` and `pull`."""

import gzip
import types

import pytest
import ride_writer
import serial_line
from emulated import calibrated, firmware, leaning, pico
from fake_board import FakeBoard
from kickstand_tools.deploy import connection
from kickstand_tools.rides.pull import pull
from kickstand_tools.rides.record import record
from rider import Rider
from serial_line import SerialLine

LEAN_DEG = 20.0


@pytest.fixture
def rider(chromium, address):
    rider = Rider(chromium, address + "live.html", accept_downloads=True)
    rider.page.add_init_script(serial_line.FAKE)
    yield rider
    rider.context.close()


def saved(rider, tmp_path):
    """{name: content} of what is offered, saved by clicks."""
    found = {}
    for link in rider.page.locator("#files a").all():
        with rider.page.expect_download() as download:
            link.click()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        found[path.name] = path.read_bytes()
    return found


@pytest.mark.long
@pytest.mark.chip
def test_the_lean_live_and_the_rides_of_a_board(rider, tmp_path, monkeypatch):
    rides = {
        "/rides/000/03/00000.rid": b"".join(ride_writer.blocks(2, ride=3)[0]),
        "/rides/000/04/00000.rid": b"".join(ride_writer.blocks(1, ride=4, speed=True)[0]),
    }
    with pico(leaning(LEAN_DEG), {**firmware(), **calibrated(), **rides}) as device:
        line = SerialLine(rider, device)
        rider.page.reload()
        device.run(0.5)
        rider.page.click("#start")
        rider.page.wait_for_function("document.querySelector('#lean').textContent === '20°'", timeout=300_000)
        assert rider.text("#side") == "right"
        rider.page.click("#stop")
        rider.page.wait_for_selector("#files li", timeout=100_000)
        assert rider.text("#live-said") == "Stopped."
        print(device.time_s, line.said[-200:])
