"""The page Live in Chromium: it receives a board's lean, and fetches its rides, over a cable or over Bluetooth.

A board at the cable answers in the test's process. Python starts once, because most tests use one page. With
Bluetooth, a simulated board is on a virtual radio.
"""

import functools
import gzip
import json

import pytest
from kickstand_tools.deploy import connection
from kickstand_tools.rides.pull import pull
from support import device_plans
from support.fake_board import FakeBoard
from support.recordings import ride_writer
from support.web.raw_prompt import RawPrompt
from support.web.rider import LAPTOP, PHONE, Rider
from support.web.saved_by_page import recorded, saved
from support.web.serial_line import SerialLine

pytestmark = pytest.mark.long
half_seconds = functools.partial(ride_writer.blocks, length=lambda _: 512)  # blocks of half a second, as in a stream


@pytest.fixture(scope="module")
def line(chromium, address):
    line = SerialLine(chromium, address + "live.html")
    yield line
    assert line.rider.errors == [] and line.rider.strangers() == []
    line.rider.context.close()


@pytest.fixture
def page(line):
    line.rider.page.evaluate("document.querySelector('#files').replaceChildren()")
    return line.rider.page


@pytest.fixture
def board(tmp_path):
    (tmp_path / "flash" / "rides").mkdir(parents=True)
    return FakeBoard(tmp_path / "flash")


def start(line, board, *streams, **kind):
    line.plug_in(RawPrompt(board, *streams, **kind))
    line.rider.page.click("#start")
    line.rider.page.wait_for_selector("#live-said:has-text('Recording: ')")


def test_pulled_cable_leaves_the_log(line, page, board, tmp_path):
    """Before that, the gauge shows "--", because the bike sways too much for a certain lean."""
    blocks, _ = half_seconds(3)
    start(line, board, blocks)
    assert (line.rider.text("#lean"), line.rider.text("#max-left")) == ("--", "--")
    line.connected = False
    page.wait_for_selector("#files li")
    assert line.rider.text("#live-said") == "Stopped. Connection lost: the log up to there is kept."
    assert list(saved(line.rider, tmp_path).values()) == recorded(blocks)


def test_after_a_new_alignment_another_log_begins(line, page, board, tmp_path):
    blocks = half_seconds(3)[0], half_seconds(2, trim_deg=1.0)[0]
    line.plug_in(RawPrompt(board, [*blocks[0], *blocks[1]], blocks[1]))
    page.click("#start")
    page.wait_for_selector("#files li")
    page.wait_for_selector("#live-said:has-text('Recording: ')")
    page.click("#stop")
    page.wait_for_selector("#files li + li")
    assert line.rider.text("#live-said") == "Stopped." and board.resets == 2
    assert list(saved(line.rider, tmp_path).values()) == [*recorded(blocks[1]), *recorded(blocks[0])]


def unpacked(data):
    return gzip.decompress(data) if data.startswith(b"\x1f\x8b") else data


def test_pulled_rides_equal_those_of_the_command(line, page, board, tmp_path, monkeypatch):
    """A board without the firmware is sent to the page Install. The rides can be opened on the page Rides."""
    line.plug_in(RawPrompt(board))
    page.click("#pull")
    page.wait_for_selector("#pull:enabled:visible")
    assert line.rider.text("#pull-said").startswith("Kickstand is not on the board at this port: install it")
    damaged = ride_writer.blocks(2, ride=4)[0]
    damaged[1] = damaged[1][:500] + b"?" + damaged[1][501:]
    for number, blocks in {3: ride_writer.blocks(2, ride=3, speed=True)[0], 4: damaged}.items():
        path = board.root / f"rides/000/{number:02}/00000.rid"
        path.parent.mkdir(parents=True)
        path.write_bytes(b"".join(blocks))
    has_firmware(board, monkeypatch)
    line.plug_in(RawPrompt(board))
    page.click("#pull")
    page.wait_for_selector("#files li")
    words = line.rider.text("#pull-said")
    assert words.startswith("2 rides are here") and "Ride 4, part 0: damaged at byte 4096: left out" in words
    assert line.rider.axe() == []
    files = saved(line.rider, tmp_path)
    monkeypatch.setattr(connection, "ConnectedBoard", lambda name, timeout: board)
    pull("the same board", tmp_path / "out")
    pulled = {path.name: unpacked(path.read_bytes()) for path in (tmp_path / "out").iterdir()}
    assert {name: unpacked(data) for name, data in files.items()} == pulled
    with line.rider.context.expect_page() as opened:
        page.click("#files li:first-child button")
    opened.value.wait_for_selector("#held li:has-text('ride-00004-')", state="attached")
    opened.value.close()


def has_firmware(board, monkeypatch):
    """Make the modules that list the rides read this board's flash."""
    import types

    from kickstand.rides import ride_files

    monkeypatch.setattr(ride_files, "directory", lambda _settings: "rides")
    monkeypatch.setattr(ride_files, "os", board.modules["os"])
    settings = types.SimpleNamespace(VEHICLE="motorcycle")
    board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: settings))
    board.modules["kickstand.rides"] = types.SimpleNamespace(ride_files=ride_files)


def test_simulated_board_is_watched_without_a_real_one(chromium, address):
    """The page shows a lean to each side, marked as simulated. The chart of the last minute is on the first screen.
    Before the start the page shows no empty figures and no empty chart."""
    rider = Rider(chromium, address + "live.html", **PHONE)
    page = rider.page
    page.evaluate("document.documentElement.dataset.serial = 'no'")
    values = "#chart", "#max-left", "#lean"
    assert not any(page.is_visible(selector) for selector in values)
    page.click("#simulated")
    for side in "right", "left":
        page.wait_for_selector(f"#side:has-text('{side}')")
        assert page.is_visible("#gauge") and not page.is_visible("#start")
    assert rider.text("#pretend-said").startswith("A simulated ride, which nobody has ridden: 0:")
    assert rider.text("#max-right") != "--"
    for kind in PHONE, LAPTOP:
        page.set_viewport_size(kind["viewport"])
        chart = page.locator("#chart").bounding_box()
        assert rider.fits() and chart["y"] + chart["height"] < kind["viewport"]["height"]
    page.click("#simulated-stop")
    assert rider.text("#pretend-said") == "Stopped."
    page.wait_for_selector("#lean:has-text('--')", state="attached")
    assert not any(page.is_visible(selector) for selector in values)
    assert rider.errors == [] and rider.strangers() == []
    rider.context.close()


# Bluetooth

BEGIN_S = 26.0
# The last turn lasts longer than the test, even on a busy machine.
RIDE = [["kickstand", 8.0], ["upright", 8.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 900.0]]
PLAN = {"ride": RIDE, "presses": device_plans.PRESSES, "config": {"LIVE": True}, "until": 900}
READS = (
    "pattern => new RegExp(pattern).test(`${document.querySelector('#lean').textContent} "
    "${document.querySelector('#side').textContent}`)"
)


@pytest.fixture
def on_the_bar(chromium, address, tmp_path):
    """Return the page on a phone, and its Bridge to the board."""
    pytest.importorskip("bumble", reason="no bumble")
    from support.web.bluetooth_bridge import FAKE, Bridge

    with Bridge(PLAN, BEGIN_S, tmp_path) as bridge:
        rider = Rider(chromium, address + "live.html", script=FAKE, **PHONE)
        rider.page.expose_function("radioDo", bridge.do)
        rider.page.expose_function("radioHeard", bridge.heard)
        rider.page.expose_function("radioMs", bridge.ms)
        assert bridge.ready.wait(240)
        yield rider, bridge
        errors, strangers = list(rider.errors), rider.strangers()
        rider.context.close()  # in any case, because the page asks for the time without an end
        assert errors == [] and strangers == []


def test_lean_over_bluetooth_fills_the_screen_and_returns(on_the_bar, tmp_path):
    """In a left turn of 30 degrees the page shows the lean. When the connection is lost the page shows "--", and later
    the lean again. At the end the rider stops and saves the ride."""
    rider, bridge = on_the_bar
    page = rider.page

    def reads(pattern):
        page.wait_for_function(READS, arg=pattern)

    page.evaluate("boardThere = false")
    page.click("#ride")
    page.wait_for_selector("#riding-said:has-text('No board was chosen. Is LIVE = True')")
    page.evaluate("boardThere = true")
    page.click("#ride")
    reads("^(29|30|31)° left$")
    assert page.evaluate("asked.at(-1).filters[0].services[0]") == "7b6f0000-3c1e-4d5a-9a55-6b69636b7374"
    assert page.evaluate("awake") == 1 and not page.is_visible("nav") and page.is_visible("#last-stop")
    assert page.locator("#lean").bounding_box()["height"] > 100 and rider.fits() and rider.axe() == []
    bridge.drop()
    page.wait_for_selector("#riding-now:has-text('The connection is lost')")
    reads("^-- ")
    reads("^(29|30|31)° left$")
    bridge.silence(True)
    reads("^-- ")
    bridge.silence(False)
    reads("^(29|30|31)° left$")
    page.click("#ride-stop")
    page.wait_for_selector("#files li")
    assert page.evaluate("awake") == 0 and page.is_visible("nav")
    log, calibration = saved(rider, tmp_path).values()
    assert log.startswith(b"t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n") and log.count(b"\n") > 10
    assert json.loads(calibration)["aligned"] is True


TIMES = """async (packets) => {
  const { BoardTime } = await import(PAGE + "/live/bluetooth/board_time.mjs");
  const time = new BoardTime();
  return packets.map(([ms, arrivedMs]) => {
    const { s, lateMs } = time.take(ms, arrivedMs);
    return [Math.round(1000 * s), Math.round(lateMs)];
  });
}"""


def test_the_time_of_packets_goes_on_and_late_ones_are_known(node):
    """The packets' time of 16 bits overflows after 65.536 s."""
    packets = [[65000, 1000], [65040, 1045], [4, 1540], [44, 4000], [3004, 4100]]
    assert node(TIMES, packets) == [[0, 0], [40, 5], [540, 0], [580, 2420], [3540, 0]]
