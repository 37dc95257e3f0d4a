"""Speed sources on the emulated boards, with the firmware's own drivers, MicroPython's pin interrupts and its UART."""

import json
from typing import Any

import pytest
from support.emulated import CHIPS, modules

pytestmark = pytest.mark.chip

_LISTEN = """
from time import sleep_ms, ticks_add, ticks_diff, ticks_ms
from kickstand.settings import Settings
from kickstand.speed.source import open_speed
def opened(source):
    class Config:
        SPEED = source
    return open_speed(Settings(Config))
speeds = [opened(source) for source in %r]
got, end = [[] for _ in speeds], ticks_add(ticks_ms(), 1800)
while ticks_diff(end, ticks_ms()) > 0:
    for i in range(len(speeds)):
        new = speeds[i].poll(ticks_ms())
        if new is not None:
            got[i].append(new)
    sleep_ms(10)
print(got)
"""


@pytest.mark.parametrize(
    ("chip", "sources"),
    [
        ("pico", ["wheel"]),
        pytest.param("esp32", ["wheel", "gps"], marks=[pytest.mark.esp32, pytest.mark.nightly]),
    ],
)
def test_wheel_and_gps(chip, sources):
    """The contact of the wheel sensor bounces."""
    board: Any = CHIPS[chip](files=modules(chip))
    with board as device:
        device.fit_wheel(lambda t_s: 15.0, bounce_us=1000)
        if "gps" in sources:
            device.fit_gps(lambda t_s: 15.0)
        got = json.loads(device.exec(_LISTEN % sources, 20.0).splitlines()[-1])
    assert len(got) == len(sources)
    for speeds in got:
        assert len(speeds) >= 2
        assert speeds == pytest.approx([15.0] * len(speeds), abs=0.3)
