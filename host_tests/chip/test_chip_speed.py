"""Wheel pulses on the emulated Pico: the real, hard pin interrupts under the firmware's own."""

import json

import pytest
from emulated import calibrated, firmware, leaning, pico, shows
from kickstand_tools.simulated_board.lcd import shown_lean
from kickstand_workshop.bench.sample_count import SampleCount

pytestmark = pytest.mark.chip

_LISTEN = """
import json
from time import sleep_ms, ticks_add, ticks_diff, ticks_ms
from kickstand.settings import Settings
from kickstand.speed.source import open_speed
class Config:
    SPEED = "wheel"
speed = open_speed(Settings(Config))
got, end = [], ticks_add(ticks_ms(), 3200)
while ticks_diff(end, ticks_ms()) > 0:
    new = speed.poll(ticks_ms())
    if new is not None:
        got.append(new)
    sleep_ms(10)
print(json.dumps([got, speed.source.fault(ticks_ms())]))
"""


def test_wheel_pulses_on_the_chip(at_prompt):
    at_prompt.fit_wheel(lambda t_s: 15.0, bounce_us=1000)
    got, fault = json.loads(at_prompt.exec(_LISTEN, 20.0))
    assert len(got) >= 10
    assert got == pytest.approx([15.0] * len(got), abs=0.2)
    assert fault is None


@pytest.mark.nightly  # the whole device in a storm: host_tests/device/test_device_starved.py
def test_a_storm_of_pulses_costs_no_reading():
    """A contact beside an ignition cable. Without its limit the interrupt leaves the loop no time at all."""
    storm_s, resets = 1e9, []
    files = firmware() | calibrated() | {"/config.py": b'SPEED = "wheel"\n'}
    with pico(leaning(20.0), files) as device:
        device.fit_wheel(lambda t_s: 50_000 / 0.5 if t_s >= storm_s else 0.0)
        shows(device, "Lean +20", 8.0)
        samples, reset = SampleCount(device.board.sensor), device._reset

        def count_reset():
            resets.append(device.time_s)
            reset()

        device.chip.on_reset = count_reset
        samples.begin()
        storm_s = device.time_s
        shows(device, "Wheel: noise *.check wiring", 0.4)
        device.run_until(lambda: shown_lean(device.lcd()) == 20.0, 2.5)  # the notice stands for 2 s
        assert samples.taken() > 400
        assert samples.lost() <= 4  # those of one transfer to the sensor that may have timed out
    assert resets == []
