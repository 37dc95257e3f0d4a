"""An emulated Pico with the pages Install and Live."""

import pytest
from kickstand_tools.simulated_board.lcd import shown_lean
from kickstand_tools.simulation.scripted.script import Ride, kickstand, upright
from kickstand_tools.simulation.scripted.sensor_errors import Sensor
from support.checked_board import part
from support.emulated import calibrated, firmware, leaning, modules, pico, shows
from support.web.saved_by_page import recorded, saved, streamed
from support.web.serial_line import SerialLine

LEAN_DEG = 20.0


@pytest.mark.nightly  # other tests cover `flash` on an emulated board, and the page with a fake board
@pytest.mark.chip
def test_board_is_updated_and_watched(chromium, address, tmp_path):
    """The board keeps its calibration. The page shows the display's lean, and saves the log of `kickstand record`."""
    line = SerialLine(chromium, address + "install.html")
    rider = line.rider
    old = {path: b"old" if path == "/kickstand/lean/meter.mpy" else data for path, data in firmware().items()}
    with pico(leaning(LEAN_DEG), {**old, **calibrated(), "/kickstand/gone.mpy": b""}) as device:
        device.run(0.5)
        line.plug_in(device)
        assert line.look().startswith("Raspberry Pi Pico with RP2040, MicroPython 1.26.1 is there.")
        said = line.install()
        assert said.startswith("Done: Raspberry Pi Pico with RP2040, MicroPython 1.26.1. 2 files copied and verified")
        assert "config.py stays" in said
        assert "/kickstand/gone.mpy" not in device.files()
        line.plug_in(device)
        status = line.status()
        assert status.startswith("Kickstand ") and "0x68" in status, status
        rider.page.goto(address + "live.html")
        line.plug_in(device)
        rider.page.click("#start")
        rider.page.wait_for_function("document.querySelector('#lean').textContent === '20°'", timeout=300_000)
        assert rider.text("#side") == "right"
        assert shown_lean(device.lcd()) == LEAN_DEG
        rider.page.click("#stop")
        rider.page.wait_for_selector("#files li", timeout=120_000)
    assert rider.text("#live-said") == "Stopped."
    # Wait until the gauge gets no new value
    rider.page.wait_for_function("document.querySelector('#lean').textContent === '--'")
    blocks = streamed(bytes(line.said))
    assert len(blocks) > 1
    assert list(saved(rider, tmp_path).values()) == recorded(blocks)
    assert rider.errors == []
    rider.context.close()


@pytest.mark.nightly
@pytest.mark.chip
def test_interrupted_installation_is_completed_up_to_the_lean(chromium, address):
    """The test takes all steps of a rider: install, unplug, press on the stand, press upright. Most files are already
    on the board, because copying all of them takes a minute."""
    line = SerialLine(chromium, address + "install.html")
    poses = Ride([kickstand(5.5), upright(5.5), upright(1e6, lean_deg=LEAN_DEG)])
    # a tenth of the usual sensor errors, because no calibration corrects them in this test
    part = Sensor(seed=1, share=0.1)
    feels, started_s = part.world(poses.motion), 0.0
    missing = ("/main.py", "/kickstand/calibration/")
    there = {path: data for path, data in firmware().items() if not path.startswith(missing)}
    with pico(lambda t_s: feels(max(0.0, t_s - started_s)), there) as device:
        device.run(0.5)
        line.plug_in(device)
        assert line.look().startswith("Raspberry Pi Pico with RP2040, MicroPython 1.26.1 is there.")
        assert "files copied and verified" in line.install()
        assert {path: device.files()[path.strip("/")] for path in firmware()} == firmware()
        device.power_cycle()
        shows(device, "On stand: press", 4.0)
        started_s = device.time_s
        device.run(2.0)
        device.press()
        shows(device, "Now upright: ", 4.5)
        device.run_until(lambda: poses.truth(device.time_s - started_s)[3] == "upright", 8.0)
        device.press()
        shows(device, "Aligned!", 4.5)
        device.run_until(lambda: poses.truth(device.time_s - started_s)[0] > LEAN_DEG - 0.1, 8.0)
        device.power_cycle()
        device.run_until(lambda: shown_lean(device.lcd()) is not None, 4.0)
        assert shown_lean(device.lcd()) == pytest.approx(LEAN_DEG, abs=2.0)
    assert line.rider.errors == []
    line.rider.context.close()


@pytest.mark.nightly
@pytest.mark.chip
def test_a_board_is_checked_on_the_page(chromium, address):
    """The page shows the same lines as the command, including the request to press the button."""
    line = SerialLine(chromium, address + "install.html")
    with pico(part(4, share=0.3), modules()) as device:
        device.run(0.5)
        line.plug_in(device)
        for k in range(1, 5):  # one sample arrives during the request
            device.board.press(device.time_s + 1.5 * k, 0.2)
        shown = line.check().strip().split("\n")
    assert shown[0].startswith("ok   board") and "Raspberry Pi Pico" in shown[0]
    assert shown[-1] == "all 30 are as they should be"
    line.rider.context.close()
