"""Reads the display of a simulated device at chosen moments of the demo's ride.

The device runs in a separate process, because the firmware uses the simulated board's clock and files. The process
prints JSON: {name: [codes of both lines, character memory]} for a character display, {name: pixels} for an OLED.
"""

import json
import os
import subprocess
import sys
import tempfile
from typing import Any

from kickstand_tools.common import firmware_path
from kickstand_tools.demo.device import KICKSTAND_PRESS_S, LONG_PRESS_S, PART_SEED, PART_SHARE, SCRIPT, UPRIGHT_PRESS_S
from kickstand_tools.simulated_board.oled import Oled
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted.script import Ride
from kickstand_tools.simulation.scripted.sensor_errors import Sensor

# The demo's bike turns to the right from 32 to 39 s, brakes from 50 to 56 s, and then stands. The presses capture the
# pose on the kickstand and the upright pose, then show the page of maxima and the page of braking
PRESSES_S = (KICKSTAND_PRESS_S, UPRIGHT_PRESS_S, 48.0, 51.0)
LONG_PRESS_AT_S = 58.0
MOMENTS_S = {
    "starting": 0.26,
    "on_stand": 3.0,
    "hold_still": 5.5,
    "upright": 9.0,
    "aligned": 16.0,
    "lean": 36.0,
    "maxima": 50.0,
    "brake": 53.0,
    "menu": 60.0,
}


UNPLUGGED_S = 44.0, 0.3  # start and duration of the fault that causes the page "unsure", an unplugged sensor
OLED_MOMENTS_S = {"lean": 36.0, "unsure": 44.9, "maxima": 50.05, "brake": 53.07, "menu": 60.0}


def lcd_pages() -> dict[str, tuple[list[list[int]], bytes]]:
    """Return {name of a moment: (codes of both lines, the 64 bytes of character memory)}."""
    return {name: (codes, bytes(cgram)) for name, (codes, cgram) in _device_pages("lcd").items()}


def oled_pages() -> dict[str, bytes]:
    """Return {name of a moment: pixels}, in the form of Oled.pixels()."""
    return {name: bytes(pixels) for name, pixels in _device_pages("ssd1306").items()}


def _device_pages(display: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as flash:
        done = subprocess.run(
            [sys.executable, "-m", __name__, display],
            env=os.environ | {"PYTHONPATH": firmware_path.search_path()},
            cwd=flash,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    return json.loads(done.stdout.splitlines()[-1])


def _run(display: str) -> dict[str, Any]:
    """Run the device. After this function the process cannot run another device."""
    ride = Ride(SCRIPT)
    board = Board(Sensor(seed=PART_SEED, share=PART_SHARE).world(ride.motion), display=display)
    for at_s in PRESSES_S:
        board.press(at_s)
    board.press(LONG_PRESS_AT_S, LONG_PRESS_S)
    if display != "lcd":
        board.faults.unplug_sensor(*UNPLUGGED_S)
    seen = {}

    def look(name: str) -> None:
        lcd = board.lcd
        seen[name] = list(lcd.pixels()) if isinstance(lcd, Oled) else (lcd.codes(), list(lcd.cgram))

    for name, at_s in (MOMENTS_S if display == "lcd" else OLED_MOMENTS_S).items():
        board.at(at_s, lambda name=name: look(name))
    board.install()
    from kickstand.start import main  # imported after install(), which replaces `machine` and `time`

    board.run(main, ride.seconds)
    return seen


if __name__ == "__main__":
    print("\n" + json.dumps(_run(sys.argv[1])))
