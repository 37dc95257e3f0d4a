"""`kickstand status` after a ride, by mpremote's real sequence of prompts, on the emulated chips."""

import pytest
from support import command, emulated, emulated_port


@pytest.mark.long
@pytest.mark.chip
@pytest.mark.parametrize("chip", emulated.CHIPS)
def test_status_after_a_ride_has_its_worst_values(chip, monkeypatch):
    files = emulated.firmware(chip) | emulated.calibrated()
    with emulated.CHIPS[chip](emulated.leaning(20), files) as device:
        device.run(10.0)
        emulated_port.plug_in(monkeypatch, device)
        lines = command.works("status", "--port", emulated_port.NAME).out.splitlines()
    labels = [line[:12].strip() for line in lines]
    assert {"Axes", "Since start", "Vibration", "Memory"} <= set(labels)
    assert labels.index("Since start") + 1 == labels.index("Vibration")
