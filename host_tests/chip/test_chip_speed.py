"""Wheel pulses on the emulated Pico: the real, hard pin interrupts under the firmware's own."""

import json

import pytest
from emulated import modules, pico

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
print(json.dumps([got, speed.fault(ticks_ms())]))
"""


def test_wheel_pulses_on_the_chip():
    with pico(files=modules()) as device:
        device.fit_wheel(lambda t_s: 15.0, bounce_us=1000)
        got, fault = json.loads(device.exec(_LISTEN, 20.0))
    assert len(got) >= 10
    assert got == pytest.approx([15.0] * len(got), abs=0.2)
    assert fault is None
