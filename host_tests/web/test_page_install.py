"""The page puts the firmware onto an emulated Pico, with the code of `kickstand flash`."""

import pytest
import serial_line
from emulated import calibrated, firmware, leaning, pico, shown_lean
from rider import Rider
from serial_line import SerialLine

OTHER = "import sys\nclass Other: pass\nother = Other()\nsys.modules['sys'] = other\nother.platform = 'rp2'\n"
OLD = "name, version, _machine, _mpy = 'micropython', (1, 22, 2), 'Raspberry Pi Pico with RP2040', 0\n"
OLD = OTHER + "class Old:\n    " + OLD + "other.implementation = Old\n"
STRANGE = OTHER + "other.implementation, other.platform = sys.implementation, 'stm32'\n"


@pytest.fixture
def rider(chromium, address):
    rider = Rider(chromium, address + "install.html")
    rider.page.add_init_script(serial_line.FAKE)
    yield rider
    rider.context.close()


def plugged_in(rider, device):
    line = SerialLine(rider, device)
    rider.page.reload()
    device.run(0.5)
    return line


@pytest.mark.long
@pytest.mark.chip
def test_an_update_over_a_cable_that_is_pulled_and_plugged_in_again(rider):
    """The calibration stays, nothing starts in between, and in the end the board shows its lean."""
    old = {path: b"old" if path == "/kickstand/lean/meter.mpy" else data for path, data in firmware().items()}
    with pico(leaning(20.0), {**old, **calibrated(), "/kickstand/gone.mpy": b""}) as device:
        line = plugged_in(rider, device)
        line.cut_after = 5000
        assert "connection lost" in line.install()
        line.cut_after = None
        device.power_cycle()
        device.run(3.0)
        assert not device.board.lcd.on  # without its main.py
        said = line.install()
        assert said.startswith("Done: Raspberry Pi Pico with RP2040, MicroPython 1.26.1.")
        assert "as they were" in said and "config.py stays" in said
        device.power_cycle()
        assert device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 30.0) is not None
    assert rider.errors == []


@pytest.mark.chip
@pytest.mark.parametrize(
    ("boot", "words"), [(OLD, "1.22.2: put MicroPython 1.23 or newer"), (STRANGE, "runs on a Raspberry Pi Pico")]
)
def test_a_board_that_does_not_fit_is_left_alone(rider, boot, words):
    with pico(files={"/boot.py": boot.encode()}) as device:
        assert words in plugged_in(rider, device).install()


def test_a_browser_without_serial_ports_says_so(chromium, address):
    rider = Rider(chromium, address + "install.html")
    rider.page.add_init_script("delete Navigator.prototype.serial")
    rider.page.reload()
    rider.page.wait_for_selector("#install-unable:not([hidden])")
    assert rider.page.is_hidden("#install-form")
    rider.context.close()
