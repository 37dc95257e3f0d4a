"""The pages Install and Live with an emulated Pico, whose MicroPython answers at the page's serial port."""

import pytest
from kickstand_tools.simulated_board.lcd import shown_lean
from support.emulated import calibrated, firmware, leaning, pico
from support.web.saved_by_page import recorded, saved, streamed
from support.web.serial_line import SerialLine

LEAN_DEG = 20.0


@pytest.mark.long
@pytest.mark.chip
def test_board_is_updated_and_watched(chromium, address, tmp_path):
    """The board keeps its calibration. The page shows the display's lean, and saves the log of `kickstand record`."""
    line = SerialLine(chromium, address + "install.html")
    rider = line.rider
    older = {path: b"old" if path == "/kickstand/lean/meter.mpy" else data for path, data in firmware().items()}
    with pico(leaning(LEAN_DEG), {**older, **calibrated(), "/kickstand/gone.mpy": b""}) as device:
        device.run(0.5)
        line.plug_in(device)
        assert line.look().startswith("Raspberry Pi Pico with RP2040, MicroPython 1.26.1 is there.")
        assert "2 files copied and verified" in line.install() and "/kickstand/gone.mpy" not in device.files()
        line.plug_in(device)
        status = line.status()
        assert status.startswith("Kickstand ") and "0x68" in status, status
        rider.page.goto(address + "live.html")
        line.plug_in(device)
        rider.page.click("#start")
        rider.page.wait_for_selector("#lean:has-text('20°')", timeout=300_000)
        assert rider.text("#side") == "right" and shown_lean(device.lcd()) == LEAN_DEG
        rider.page.click("#stop")
        rider.page.wait_for_selector("#files li")
    assert rider.text("#live-said") == "Stopped."
    blocks = streamed(bytes(line.said))
    assert len(blocks) > 1 and list(saved(rider, tmp_path).values()) == recorded(blocks)
    assert rider.errors == []
    rider.context.close()
