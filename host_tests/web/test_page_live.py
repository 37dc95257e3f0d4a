"""The page Live receives a board's lean and fetches its rides, with the code of `kickstand record` and `pull`."""

import functools
import gzip
import json
import types

import pytest
from kickstand.rides import ride_paths
from kickstand_tools.deploy import connection
from kickstand_tools.rides.pull import pull
from support.fake_board import FakeBoard
from support.recordings import ride_writer
from support.web.raw_prompt import RawPrompt
from support.web.rider import LAPTOP, MISSING, PHONE, Rider
from support.web.saved_by_page import recorded, saved
from support.web.serial_line import SerialLine

PLAYED = """async () => {
  const player = new (await import("./live/player.mjs")).Player();
  player.take([[0, 10, 0], [0.49, 20, 0]], 1000);
  return [1600, 2100, 2300].map((nowMs) => player.now(nowMs).moment?.[1] ?? null);
}"""
REFUSED = "() => Object.defineProperty(window, 'indexedDB', { value: { open() { throw new Error('refused'); } } })"

half_seconds = functools.partial(ride_writer.blocks, length=lambda _: 512)  # blocks of half a second, as in a stream


@pytest.fixture(scope="module")
def line(chromium, address):
    """Return one page for all tests, so that Python is loaded only once."""
    line = SerialLine(chromium, address + "live.html")
    yield line
    assert line.rider.errors == [] and line.rider.strangers() == []
    line.rider.context.close()


@pytest.fixture
def rider(line):
    line.rider.page.evaluate("document.querySelector('#files').replaceChildren()")
    return line.rider


@pytest.fixture
def board(tmp_path):
    (tmp_path / "flash" / "rides").mkdir(parents=True)
    return FakeBoard(tmp_path / "flash")


def test_pulled_cable_leaves_the_log(line, rider, board, tmp_path):
    """After the cable is pulled, the gauge shows no lean. Before the cable is pulled, the gauge shows "--" while the
    bike sways too much for a certain lean."""
    blocks, _ = half_seconds(3)
    line.plug_in(RawPrompt(board, blocks))
    rider.page.click("#start")
    rider.page.wait_for_function("document.querySelector('#live-said').textContent.startsWith('Recording: ')")
    assert (rider.text("#lean"), rider.text("#max-left")) == ("--", "--")
    line.connected = False
    rider.page.wait_for_selector("#files li")
    assert rider.text("#live-said") == "Stopped. Connection lost: the log up to there is kept."
    assert list(saved(rider, tmp_path).values()) == recorded(blocks)


def test_car_shows_g_instead_of_a_lean(line, rider, board, tmp_path, monkeypatch):
    """The calibration in the log also says "car". When a motorcycle is connected next, the gauge appears again."""
    monkeypatch.setattr(ride_writer, "turns", braking_in_a_left_bend)
    line.plug_in(RawPrompt(board, half_seconds(3)[0], vehicle="car"))
    rider.page.click("#start")
    rider.page.wait_for_function("document.querySelector('#lean').textContent === '0.30 g'")
    assert (rider.text("#side"), rider.text("#forward")[1:]) == ("left", "0.20 g")
    assert rider.page.get_attribute("#gauge", "aria-label") == "Sideways now: 0.30 g left"
    assert (rider.text("#max-left-name"), rider.text("#max-left")) == ("Peak braking", "0.20 g")
    line.connected = False
    rider.page.wait_for_selector("#files li")
    log, calibration = saved(rider, tmp_path).values()
    assert json.loads(calibration)["vehicle"] == "car"
    assert log.count(b"\n") > 100
    rider.page.wait_for_selector("#start:enabled:visible")
    line.plug_in(RawPrompt(board, half_seconds(3)[0]))
    rider.page.click("#start")
    rider.page.wait_for_selector("#max-left-name:has-text('Most left')")
    line.connected = False
    rider.page.wait_for_selector("#start:enabled:visible")


def braking_in_a_left_bend(count, seed=0):
    """Yield passes of the loop as ride_writer.turns() does, for a car with forces of 0.2 g backward and 0.3 g to the
    left."""
    for _ in range(count):
        yield [2 * mean for mean in (-851, 1324, 4096, 0, 0, 98, 0)], 2, 10_000


def test_a_lean_ends_soon_after_the_last_block(rider):
    assert rider.page.evaluate(PLAYED) == [20, 20, None]


def test_failed_loading_of_tools_can_be_repeated(chromium, address, board):
    """If the browser has no store that other pages can read, the page explains how to transfer the files."""
    line = SerialLine(chromium, address + "live.html", service_workers="block")
    rider = line.rider
    line.plug_in(RawPrompt(board, half_seconds(3)[0]))
    for name in ("python.mjs", "pyodide.asm.wasm"):  # Pyodide itself does not report that pyodide.asm.wasm is missing
        rider.page.route(f"**/{name}", lambda route: route.abort())
        rider.page.click("#start")
        rider.page.wait_for_selector("#live-said:has-text('Is there a network? Press the button again')")
        rider.page.unroute(f"**/{name}")
        rider.page.evaluate("document.querySelector('#live-said').textContent = ''")
    rider.page.evaluate(MISSING, ["install.zip", 404])
    for press, says in (("#start", "#live-said"), ("#pull", "#pull-said")):
        rider.page.click(press)
        rider.page.wait_for_selector(f"{says}:has-text('install.zip cannot be loaded (HTTP 404)')", timeout=60_000)
        assert rider.page.is_enabled(press)
    rider.page.evaluate("given()")
    rider.page.click("#start")
    rider.page.wait_for_selector("#live-said:has-text('Recording')", timeout=60_000)
    line.connected = False
    rider.page.wait_for_selector("#files li")
    assert rider.errors == []
    rider.page.evaluate(REFUSED)
    rider.page.click("#files li button")
    rider.page.wait_for_selector("#files li:has-text('save both, and choose them on the page Rides')")
    rider.context.close()


def test_after_a_new_alignment_another_log_begins(line, rider, board, tmp_path):
    blocks = half_seconds(3)[0], half_seconds(2, trim_deg=1.0)[0]
    line.plug_in(RawPrompt(board, [*blocks[0], *blocks[1]], blocks[1]))
    rider.page.click("#start")
    rider.page.wait_for_selector("#files li")
    rider.page.wait_for_function("document.querySelector('#live-said').textContent.startsWith('Recording: ')")
    rider.page.click("#stop")
    rider.page.wait_for_selector("#files li + li")
    assert rider.text("#live-said") == "Stopped."
    assert list(saved(rider, tmp_path).values()) == [*recorded(blocks[1]), *recorded(blocks[0])]
    assert board.resets == 2


def test_pulled_rides_equal_those_of_the_command(line, rider, board, tmp_path, monkeypatch):
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
    said = rider.text("#pull-said")
    assert said.startswith("2 rides are here")
    assert rider.axe() == []
    assert "Ride 4, part 0: damaged at byte 4096: left out" in said
    files = saved(rider, tmp_path)
    assert board.resets == 1
    monkeypatch.setattr(connection, "ConnectedBoard", lambda name, timeout: board)
    monkeypatch.setattr(connection, "_RESTART_S", 0)
    pull("the same board", tmp_path / "out")
    pulled = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert {name: unpacked(data) for name, data in files.items()} == {
        name: unpacked(data) for name, data in pulled.items()
    }
    with rider.context.expect_page() as opened:
        rider.page.click("#files li:first-child button")
    rides = opened.value
    assert "/rides.html" in rides.url  # the page removes #pulled from its address
    rides.wait_for_selector("#held li:has-text('ride-00004-')", state="attached", timeout=60_000)
    opened.value.close()


def unpacked(data):
    return gzip.decompress(data) if data.startswith(b"\x1f\x8b") else data


def has_firmware(board, monkeypatch):
    """Make the modules that list the rides read this board's flash."""
    monkeypatch.setattr(ride_paths, "directory", lambda _settings: "rides")
    monkeypatch.setattr(ride_paths, "os", board.modules["os"])
    settings = types.SimpleNamespace(VEHICLE="motorcycle")
    board.modules["kickstand"] = types.SimpleNamespace(settings=types.SimpleNamespace(load=lambda: settings))
    board.modules["kickstand.rides"] = types.SimpleNamespace(ride_paths=ride_paths)


def test_port_without_signals_is_closed_again(line):
    script = """async () => {
      const said = [];
      const port = {
        open: async () => said.push("open"),
        setSignals: async () => { throw new Error("Failed to open serial port."); },
        close: async () => said.push("closed"),
      };
      await (await import("./cable/cable.mjs")).overCable(port, (text) => said.push(text), () => said.push("spoken"));
      return said;
    }"""
    *done, said = line.rider.page.evaluate(script)
    assert done == ["open", "closed"]
    assert said.startswith("The port cannot be opened: Failed to open serial port. Does another program have it?")


def test_port_with_a_stuck_stream_is_closed(line):
    """If the page did not close the port, it could not open the port again."""
    script = """async () => {
      const { SerialLine } = await import("./cable/cable.mjs");
      const said = [];
      const line = new SerialLine({
        open: async () => {},
        readable: new ReadableStream({ cancel() { throw new Error("it is gone"); } }),
        close: async () => said.push("closed"),
      });
      await line.open();
      await line.close();
      return said;
    }"""
    assert line.rider.page.evaluate(script) == ["closed"]


def test_line_continues_after_a_disturbed_byte(line):
    """As with Web Serial, the stream fails at the disturbed byte. The port then has a new stream, until the cable is
    pulled."""
    script = """async () => {
      const { SerialLine } = await import("./cable/cable.mjs");
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
      return [[...line.take()], line.lost];
    }"""
    assert line.rider.page.evaluate(script) == [[1, 2], True]


def test_board_without_firmware_is_sent_to_page_install(line, rider, board):
    line.plug_in(RawPrompt(board))
    rider.page.click("#pull")
    rider.page.wait_for_selector("#pull:enabled:visible")
    assert rider.text("#pull-said") == "Kickstand is not on the board at this port: install it with the page Install."
    assert board.resets == 1


def test_simulated_board_is_watched_without_a_real_one(chromium, address):
    """The browser cannot connect to a board, like the browser of a phone. The page shows a lean to each side, marked as
    simulated. The chart of the last minute is on the first screen. Before the start the page shows no empty figures and
    no empty chart."""
    rider = Rider(chromium, address + "live.html", **PHONE)
    page = rider.page
    page.evaluate("document.documentElement.dataset.serial = 'no'")
    nothing_yet = "#chart", "#max-left", "#lean"
    assert not any(page.is_visible(one) for one in nothing_yet)
    page.click("#simulated")
    for side in "right", "left":
        rider.page.wait_for_function("side => document.querySelector('#side').textContent === side", arg=side)
        assert rider.page.is_visible("#gauge") and not rider.page.is_visible("#start")
    assert rider.text("#pretend-said").startswith("A simulated ride, which nobody has ridden: 0:")
    assert rider.text("#max-right") != "--"
    assert rider.axe() == []
    for kind in PHONE, LAPTOP:
        page.set_viewport_size(kind["viewport"])
        assert rider.fits()
        chart = page.locator("#chart").bounding_box()
        assert chart["y"] + chart["height"] < kind["viewport"]["height"], "it is not on the first screen"
    page.click("#simulated-stop")
    assert rider.text("#pretend-said") == "Stopped."
    page.wait_for_function("document.querySelector('#lean').textContent === '--'")
    assert not any(page.is_visible(one) for one in nothing_yet)
    assert rider.errors == [] and rider.strangers() == []
    rider.context.close()
