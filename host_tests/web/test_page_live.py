"""The page Live in Chromium: it receives a board's lean, and fetches its rides, over a cable or over Bluetooth.

A board at the cable answers in the test's process. Python starts once, because most tests use one page. With
Bluetooth, a simulated board is on a virtual radio.
"""

import functools
import gzip
import json
from pathlib import Path

import pytest
from kickstand_tools.deploy import connection
from kickstand_tools.rides.pull import pull
from support import device_plans
from support.command import works
from support.fake_board import FakeBoard
from support.recordings import ride_writer
from support.web.raw_prompt import RawPrompt
from support.web.rider import LAPTOP, MISSING, PHONE, Rider
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


def test_a_car_shows_g_instead_of_a_lean(line, page, board, tmp_path):
    """The calibration in the log also says "car". When a motorcycle is connected next, the gauge appears again."""
    start(line, board, half_seconds(3)[0], vehicle="car")
    page.wait_for_selector("#lean:has-text(' g')")
    assert page.get_attribute("#gauge", "aria-label").startswith("Sideways now: ")
    assert line.rider.text("#max-left-name") == "Peak braking"
    line.connected = False
    page.wait_for_selector("#files li")
    log, calibration = saved(line.rider, tmp_path).values()
    assert json.loads(calibration)["vehicle"] == "car" and log.count(b"\n") > 100
    page.wait_for_selector("#start:enabled:visible")
    start(line, board, half_seconds(3)[0])
    page.wait_for_selector("#max-left-name:has-text('Most left')")
    line.connected = False
    page.wait_for_selector("#start:enabled:visible")


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

    from kickstand.rides import ride_paths

    monkeypatch.setattr(ride_paths, "directory", lambda _settings: "rides")
    monkeypatch.setattr(ride_paths, "os", board.modules["os"])
    settings = types.SimpleNamespace(VEHICLE="motorcycle")
    board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: settings))
    board.modules["kickstand.rides"] = types.SimpleNamespace(ride_paths=ride_paths)


REFUSED = "() => Object.defineProperty(window, 'indexedDB', { value: { open() { throw new Error('refused'); } } })"


def test_failed_loading_of_tools_can_be_repeated(chromium, address, board):
    """If the browser has no store that other pages can read, the page explains how to transfer the files."""
    line = SerialLine(chromium, address + "live.html", service_workers="block")
    page = line.rider.page
    line.plug_in(RawPrompt(board, half_seconds(3)[0]))
    for name in ("python.mjs", "pyodide.asm.wasm"):  # Pyodide itself does not report that pyodide.asm.wasm is missing
        page.route(f"**/{name}", lambda route: route.abort())
        page.click("#start")
        page.wait_for_selector("#live-said:has-text('Is there a network? Press the button again')")
        page.unroute(f"**/{name}")
        page.evaluate("document.querySelector('#live-said').textContent = ''")
    page.evaluate(MISSING, ["install.zip", 404])
    for press, says in (("#start", "#live-said"), ("#pull", "#pull-said")):
        page.click(press)
        page.wait_for_selector(f"{says}:has-text('install.zip cannot be loaded (HTTP 404)')")
        assert page.is_enabled(press)
    page.evaluate("given()")
    page.click("#start")
    page.wait_for_selector("#live-said:has-text('Recording')")
    line.connected = False
    page.wait_for_selector("#files li")
    page.evaluate(REFUSED)
    page.click("#files li button")
    page.wait_for_selector("#files li:has-text('save both, and choose them on the page Rides')")
    assert line.rider.errors == []
    line.rider.context.close()


def test_simulated_board_is_watched_without_a_real_one(chromium, address):
    """The page shows a lean to each side, marked as simulated. The chart of the last minute is on the first screen.
    Before the start the page shows no empty figures and no empty chart."""
    rider = Rider(chromium, address + "live.html", **PHONE)
    page = rider.page
    page.evaluate("document.documentElement.dataset.serial = 'no'")
    values = "#chart", "#max-left", "#lean"
    assert not any(page.is_visible(one) for one in values)
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
    assert not any(page.is_visible(one) for one in values)
    assert rider.errors == [] and rider.strangers() == []
    rider.context.close()


@pytest.mark.parametrize(
    ("script", "result"),
    [
        pytest.param(
            """const player = new (await import("./live/player.mjs")).Player();
            player.take([[0, 10, 0], [0.49, 20, 0]], 1000);
            return [1600, 2100, 2300].map((nowMs) => player.now(nowMs).moment?.[1] ?? null);""",
            [20, 20, None],
            id="a lean ends soon after the last block",
        ),
        pytest.param(
            """const said = [];
            const port = {
              open: async () => said.push("open"),
              setSignals: async () => { throw new Error("Failed to open serial port."); },
              close: async () => said.push("closed"),
            };
            const { overCable } = await import("./cable/cable.mjs");
            await overCable(port, (text) => said.push(text), () => said.push("spoken"));
            return said;""",
            [
                *("open", "closed"),
                "The port cannot be opened: Failed to open serial port. Does another program have it? "
                "On Linux: are you in the group dialout?",
            ],
            id="a port without signals is closed again",
        ),
        pytest.param(
            """const { SerialLine } = await import("./cable/cable.mjs");
            const said = [];
            const line = new SerialLine({
              open: async () => {},
              readable: new ReadableStream({ cancel() { throw new Error("it is gone"); } }),
              close: async () => said.push("closed"),
            });
            await line.open();
            await line.close();
            return said;""",
            ["closed"],
            id="a port with a stuck stream is closed",
        ),
        pytest.param(
            """const { SerialLine } = await import("./cable/cable.mjs");
            const streams = [1, 2].map((byte) => {
              const given = [Uint8Array.of(byte)];
              return new ReadableStream({
                pull(sink) {
                  if (given.length) return sink.enqueue(given.pop());
                  streams.shift();
                  sink.error(new Error("framing"));
                },
              }, { highWaterMark: 0 });
            });
            const line = new SerialLine({ open: async () => {}, get readable() { return streams[0] ?? null; } });
            await line.open();
            for (let i = 0; i < 100 && !line.lost; i += 1) await line.sleep(10);
            return [[...line.take()], line.lost];""",
            [[1, 2], True],
            id="a line continues after a disturbed byte",
        ),
    ],
)
def test_a_module_of_the_page(page, script, result):
    assert page.evaluate(f"async () => {{ {script} }}") == result


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
        assert bridge.ready.wait(60)
        yield rider, bridge
        assert rider.errors == [] and rider.strangers() == []
        rider.context.close()


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
    assert log.startswith(b"t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n") and log.count(b"\n") > 50
    assert json.loads(calibration)["aligned"] is True


def test_browser_with_bluetooth_alone_offers_no_cable(chromium, address):
    rider = Rider(chromium, address + "live.html", **PHONE)
    rider.page.evaluate("document.documentElement.dataset.serial = 'no'")
    for bluetooth, visible in (("no", ["#unable", "#simulated"]), ("yes", ["#ride", "#simulated"])):
        rider.page.evaluate("bluetooth => (document.documentElement.dataset.bluetooth = bluetooth)", bluetooth)
        buttons = "#unable", "#ride", "#simulated", "#start", "#pull"
        assert [one for one in buttons if rider.page.is_visible(one)] == visible
    rider.context.close()


LOGGED = Path(__file__).with_name("bluetooth_log.js").read_text()


def test_saved_bluetooth_log_can_be_reported_and_smoothed(node, tmp_path):
    """In a minute of bends with a soft stop at the end, the smoothed lean is within 1.5 degrees of the displayed
    lean."""
    turns = [["turn", lean, 5.0] for lean in (-30.0, 35.0, -20.0, 40.0)]
    ride = [*RIDE[:3], *turns, ["straight", 4.0], ["brake", 0.0, 3.0], ["upright", 12.0]]
    phone = [[18.0, "connect"], [18.1, "write", "rate", [40, 0]]]
    plan = {**PLAN, "ride": ride, "board": {"machine": "pico w"}, "phones": [phone], "until": 74}
    (tmp_path / "flash").mkdir()
    record = device_plans.run("cpython", tmp_path / "flash", plan)
    packets = record.phones[0]["packets"]
    done = node(LOGGED, [packet for packet in packets if packet[1] in ("now", "ride")])
    assert 0.9 < done["stop"]["peak"] < 1.05 and 2 < done["stop"]["seconds"] < 3  # from 15 m/s in 3 s
    for name, text in done["files"]:
        (tmp_path / name).write_text(text)
    log, calibration = (tmp_path / name for name, _ in done["files"])
    assert works("report", log, "--calibration", calibration).out
    works("smooth", log, "--calibration", calibration, "--out", tmp_path / "lean.csv")
    begun_s = next(t_s for t_s, kind, data in packets if kind == "now" and data[5:7] != [0, 128])
    rows = [line.split(",") for line in (tmp_path / "lean.csv").read_text().splitlines()[1:]]
    apart_deg = [
        abs(float(lean) - shown)
        for t_s, lean, *_ in rows[:: len(rows) // 60]
        if (shown := record.lean_at(begun_s + float(t_s) + 0.1)) is not None and lean
    ]
    assert len(apart_deg) > 20 and sorted(apart_deg)[len(apart_deg) // 2] < 1.5


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
