"""The page Live over Bluetooth: a board on bumble's virtual radio behind a fake navigator.bluetooth."""

import json

import pytest
from support import device_plans
from support.command import works
from support.web.rider import PHONE, Rider
from support.web.saved_by_page import saved

pytest.importorskip("bumble", reason="no bumble")
from support.web.bluetooth_bridge import FAKE, Bridge

BEGIN_S = 26.0
# The last turn lasts longer than the test, even on a busy machine.
RIDE = [["kickstand", 8.0], ["upright", 8.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 900.0]]
PLAN = {"ride": RIDE, "presses": device_plans.PRESSES, "config": {"LIVE": True}, "until": 900}

LOGGED = """async (packets) => {
  const { BluetoothLog } = await import("./live/bluetooth/log.mjs");
  const { BoardTime } = await import("./live/bluetooth/board_time.mjs");
  const { Stops } = await import("./live/bluetooth/stops.mjs");
  const { AT_REST, decodeNow, decodeRide } = await import("./live/bluetooth/packets.mjs");
  const [log, time, stops] = [new BluetoothLog(), new BoardTime(), new Stops()];
  for (const [atS, kind, bytes] of packets) {
    const view = new DataView(Uint8Array.from(bytes).buffer);
    if (kind === "ride") {
      log.takeRide(decodeRide(view));
      continue;
    }
    const now = decodeNow(view);
    const { s } = time.take(now.ms, 1000 * atS);
    log.take(now, s);
    stops.take(s, now.force[2], (now.state & AT_REST) !== 0);
  }
  const text = ({ name, data }) => [name, new TextDecoder().decode(data)];
  return { files: log.files(new Date(0)).map(text), stop: stops.last };
}"""

LATE = """async () => {
  const { BoardTime } = await import("./live/bluetooth/board_time.mjs");
  const time = new BoardTime();
  const seen = [[65000, 1000], [65040, 1045], [4, 1540], [44, 4000], [3004, 4100]];
  return seen.map(([ms, arrived]) => {
    const { s, lateMs } = time.take(ms, arrived);
    return [Math.round(1000 * s), Math.round(lateMs)];
  });
}"""


@pytest.fixture
def on_the_bar(chromium, address, tmp_path):
    bridge = Bridge(PLAN, BEGIN_S, tmp_path)
    rider = Rider(chromium, address + "live.html", script=FAKE, **PHONE)
    rider.page.expose_function("radioDo", bridge.do)
    rider.page.expose_function("radioHeard", bridge.heard)
    assert bridge.ready.wait(60)
    yield rider, bridge
    rider.context.close()
    bridge.end()


def lean_reads(rider, pattern):
    rider.page.wait_for_function(
        "pattern => new RegExp(pattern).test(`${document.querySelector('#lean').textContent} "
        "${document.querySelector('#side').textContent}`)",
        arg=pattern,
    )


def test_lean_fills_the_screen_and_returns(on_the_bar, tmp_path):
    """In a left turn of 30 degrees the page shows the lean. When the connection is lost the page shows "--", and later
    the lean again. At the end the rider stops and saves the ride."""
    rider, bridge = on_the_bar
    page = rider.page
    page.evaluate("boardThere = false")
    page.click("#ride")
    page.wait_for_selector("#riding-said:has-text('No board was chosen. Is LIVE = True')")
    assert page.evaluate("awake") == 0
    page.evaluate("boardThere = true")
    page.click("#ride")
    lean_reads(rider, "^(29|30|31)° left$")
    page.wait_for_function("/^(29|30|31)°$/.test(document.querySelector('#max-left').textContent)")
    assert page.evaluate("asked.at(-1).filters[0].services[0]") == "7b6f0000-3c1e-4d5a-9a55-6b69636b7374"
    assert page.evaluate("awake") == 1
    assert not page.is_visible("nav") and not page.is_visible(".minute") and page.is_visible("#last-stop")
    tall = page.locator("#lean").bounding_box()["height"]
    assert tall > 100, tall
    assert rider.fits() and rider.axe() == []
    bridge.drop()
    page.wait_for_selector("#riding-now:has-text('The connection is lost')")
    lean_reads(rider, "^-- ")
    lean_reads(rider, "^(29|30|31)° left$")
    bridge.silence(True)
    lean_reads(rider, "^-- ")
    bridge.silence(False)
    lean_reads(rider, "^(29|30|31)° left$")
    page.click("#ride-stop")
    page.wait_for_selector("#files li")
    assert page.evaluate("awake") == 0 and page.is_visible("nav")
    log, calibration = saved(rider, tmp_path).values()
    assert log.startswith(b"t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n") and log.count(b"\n") > 50
    assert json.loads(calibration)["aligned"] is True
    assert rider.errors == [] and rider.strangers() == []


def test_browser_without_serial_and_bluetooth_gives_advice(chromium, address):
    rider = Rider(chromium, address + "live.html", **PHONE)
    rider.page.evaluate("['serial', 'bluetooth'].forEach((one) => (document.documentElement.dataset[one] = 'no'))")
    assert rider.page.is_visible("#unable") and not rider.page.is_visible(".side")
    assert rider.page.is_visible("#simulated")
    rider.page.evaluate("document.documentElement.dataset.bluetooth = 'yes'")
    assert rider.page.is_visible("#ride") and not rider.page.is_visible("#unable")
    assert not rider.page.is_visible("#start") and not rider.page.is_visible("#pull")
    assert rider.axe() == []
    rider.context.close()


@pytest.fixture(scope="module")
def packets(tmp_path_factory):
    """Return the packets of a minute of bends with a stop at the end, and the display's Record."""
    turns = [["turn", lean, 5.0] for lean in (-30.0, 35.0, -20.0, 40.0)] * 2
    ride = [*RIDE[:3], *turns, ["straight", 4.0], ["brake", 0.0, 3.0], ["upright", 12.0]]
    acts = [[18.0, "connect"], [18.1, "write", "rate", [40, 0]]]
    plan = {**PLAN, "ride": ride, "board": {"machine": "pico w"}, "phones": [acts], "until": 104}
    record = device_plans.run("cpython", tmp_path_factory.mktemp("flash"), plan)
    return record.phones[0]["packets"], record


def test_saved_bluetooth_log_can_be_reported_and_smoothed(chromium, address, packets, tmp_path):
    """The smoothed lean is within 1.5 degrees of the displayed lean. The log's time continues when the packets' 16-bit
    time overflows. Late packets are recognised."""
    heard, record = packets
    rider = Rider(chromium, address + "live.html")
    assert rider.page.evaluate(LATE) == [[0, 0], [40, 5], [540, 0], [580, 2420], [3540, 0]]
    done = rider.page.evaluate(LOGGED, [one for one in heard if one[1] in ("now", "ride")])
    rider.context.close()
    assert 0.9 < done["stop"]["peak"] < 1.05 and 2 < done["stop"]["seconds"] < 3  # a soft stop from 15 m/s in 3 s
    for name, text in done["files"]:
        (tmp_path / name).write_text(text)
    log, calibration = (tmp_path / name for name, _ in done["files"])
    assert works("report", log, "--calibration", calibration).out
    out = tmp_path / "lean.csv"
    works("smooth", log, "--calibration", calibration, "--out", out)
    begun_s = next(t_s for t_s, kind, data in heard if kind == "now" and data[5:7] != [0, 128])
    rows = [line.split(",") for line in out.read_text().splitlines()[1:]]
    apart = [
        abs(float(lean) - shown)
        for t_s, lean, *_ in rows[:: len(rows) // 60]
        if (shown := record.lean_at(begun_s + float(t_s) + 0.1)) is not None and lean
    ]
    assert len(apart) > 40
    assert sorted(apart)[len(apart) // 2] < 1.5, apart
