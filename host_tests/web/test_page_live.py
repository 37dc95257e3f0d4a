"""The page listens to boards and fetches their rides, with the code of `kickstand record` and `pull`."""

import base64
import gzip
import io
import types

import pytest
import ride_writer
import serial_line
from emulated import calibrated, firmware, leaning, pico
from fake_board import FakeBoard
from kickstand.rides import ride_paths
from kickstand_tools.calibration.file import write_calibration
from kickstand_tools.deploy import connection
from kickstand_tools.rides import block_reader, ride_log
from kickstand_tools.rides.pull import pull
from kickstand_tools.rides.stream import Recording
from raw_prompt import RawPrompt
from rider import Rider
from serial_line import SerialLine

SHORT = {"length": lambda _: 512}  # blocks of half a second


@pytest.fixture(scope="module")
def line(chromium, address):
    """One page for all tests, whose Python is loaded once."""
    rider = Rider(chromium, address + "live.html", accept_downloads=True)
    rider.page.add_init_script(serial_line.FAKE)
    rider.page.reload()
    yield SerialLine(rider)
    assert rider.errors == []
    rider.context.close()


@pytest.fixture
def rider(line):
    line.rider.page.evaluate("document.querySelector('#files').replaceChildren()")
    return line.rider


@pytest.fixture
def board(tmp_path):
    (tmp_path / "flash" / "rides").mkdir(parents=True)
    return FakeBoard(tmp_path / "flash")


def saved(rider, tmp_path):
    """{name: content} of all that is offered, saved by clicks."""
    found = {}
    for link in rider.page.locator("#files a").all():
        with rider.page.expect_download() as download:
            link.click()
        path = tmp_path / download.value.suggested_filename
        download.value.save_as(path)
        found[path.name] = path.read_bytes()
    return found


def recorded(blocks):
    """[log, calibration] that `kickstand record` makes of these blocks."""
    log, calibration = io.StringIO(), io.StringIO()
    recording = Recording()
    recording.write(log, iter(map(block_reader.parse, blocks)), [])
    assert recording.first
    write_calibration(calibration, ride_log.calibration(recording.first))
    return [log.getvalue().encode(), calibration.getvalue().encode()]


@pytest.mark.long
@pytest.mark.chip
def test_the_lean_of_a_board_live(line, rider, tmp_path):
    """Within a degree of what its own display shows, and kept as the same log that `kickstand record` writes."""
    with pico(leaning(20.0), {**firmware(), **calibrated()}) as device:
        line.plug_in(device)
        device.run(0.5)
        rider.page.click("#start")
        rider.page.wait_for_function("document.querySelector('#lean').textContent === '20°'", timeout=300_000)
        assert rider.text("#side") == "right"
        assert "20° right" in device.lcd()[0]
        rider.page.click("#stop")
        rider.page.wait_for_selector("#files li", timeout=120_000)
    assert rider.text("#live-said") == "Stopped."
    last = line.said.rindex(b".\r\n") + 3
    begun = line.said.rindex(b"\x04", 0, line.said.index(b"\n.\r\n")) + 1
    blocks = [base64.b64decode(block.replace(b"\r\n", b"")) for block in line.said[begun:last].split(b".\r\n")[:-1]]
    assert len(blocks) > 1
    assert list(saved(rider, tmp_path).values()) == recorded(blocks)


def test_a_cable_that_is_pulled_leaves_the_log(line, rider, board, tmp_path):
    """And no lean on the gauge. What swayed too much to tell its lean was "--" all along."""
    blocks, _ = ride_writer.blocks(3, **SHORT)
    line.plug_in(RawPrompt(board, blocks))
    rider.page.click("#start")
    rider.page.wait_for_function("document.querySelector('#live-said').textContent.startsWith('Recording: ')")
    assert (rider.text("#lean"), rider.text("#max-left")) == ("--", "--")
    line.connected = False
    rider.page.wait_for_selector("#files li")
    assert "connection lost" in rider.text("#live-said")
    assert "what came until then is kept" in rider.text("#live-said")
    assert list(saved(rider, tmp_path).values()) == recorded(blocks)


def test_the_rides_of_a_board_are_what_the_command_pulls(line, rider, board, tmp_path, monkeypatch):
    damaged = ride_writer.blocks(2, ride=4)[0]
    damaged[1] = damaged[1][:500] + b"?" + damaged[1][501:]
    for number, blocks in {3: ride_writer.blocks(2, ride=3, speed=True)[0], 4: damaged}.items():
        path = board.root / f"rides/000/{number:02}/00000.rid"
        path.parent.mkdir(parents=True)
        path.write_bytes(b"".join(blocks))
    has_firmware(board, monkeypatch)
    line.plug_in(RawPrompt(board))
    rider.page.click("#pull")
    rider.page.wait_for_selector("#files li")
    told = rider.text("#pull-said")
    assert told.startswith("2 rides are here")
    assert "ride 4, part 0: damaged at byte 4096: left out" in told
    files = saved(rider, tmp_path)
    assert board.resets == 1
    monkeypatch.setattr(connection, "SerialTransport", lambda name, timeout: board)
    monkeypatch.setattr(connection, "_RESTART_S", 0)
    pull("the same board", tmp_path / "out")
    pulled = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert {name: unpacked(data) for name, data in files.items()} == {
        name: unpacked(data) for name, data in pulled.items()
    }
    with rider.context.expect_page() as opened:
        rider.page.click("#files li:first-child button")
    assert opened.value.url.endswith("/rides.html#pulled")
    opened.value.close()


def unpacked(data):
    return gzip.decompress(data) if data.startswith(b"\x1f\x8b") else data


def has_firmware(board, monkeypatch):
    """The modules that tell the rides, on this board's flash."""
    monkeypatch.setattr(ride_paths, "directory", lambda _settings: "rides")
    monkeypatch.setattr(ride_paths, "os", board.modules["os"])
    board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: None))
    board.modules["kickstand.rides"] = types.SimpleNamespace(ride_paths=ride_paths)


@pytest.mark.parametrize(("press", "says"), [("#start", "#live-said"), ("#pull", "#pull-said")])
def test_a_board_without_the_firmware_is_told_of_the_page_install(line, rider, board, press, says):
    line.plug_in(RawPrompt(board))
    rider.page.click(press)
    rider.page.wait_for_selector(f"{press}:enabled:visible")
    assert rider.text(says) == "Kickstand is not on the board at this port: the page Install puts it there."
    assert board.resets == 1
