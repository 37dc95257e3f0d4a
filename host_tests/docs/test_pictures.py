"""The pictures in the documents match the current firmware, settings and commands."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from kickstand_sim.simulated_board import simulator
from kickstand_tools.web import site
from kickstand_workshop.pictures import displays, page, rides
from support.device_runs import FreshFirmware

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "tools" / "pictures"
STALE = "stale: run .venv/bin/python -m kickstand_workshop.pictures, look at the pictures, check them in"


def checked_in():
    return {path.name: path.read_text(encoding="utf-8") for path in PICTURES.glob("*.svg")}


@pytest.mark.long  # device and demo run to draw their displays
def test_no_drawing_is_stale():
    drawings, committed = displays.draw() | {"demo.svg": displays.draw_demo()}, checked_in()
    stale = [name for name, svg in drawings.items() if committed.get(name) != svg]
    assert not stale, f"{', '.join(stale)}: {STALE}"


@pytest.mark.long  # each case draws a ride; host_tests/analysis tests the content of plots
@pytest.mark.parametrize(("name", "draw"), [("ride.png", rides.ride_plot), ("lean_compared.png", rides.lean_compared)])
def test_no_plot_of_a_ride_is_stale(name, draw):
    """The pixels of the pictures are compared. The files themselves differ between versions of matplotlib."""
    from PIL import Image

    fresh, committed = (
        np.asarray(Image.open(io.BytesIO(data)).convert("L"), dtype=float)
        for data in (draw(), (PICTURES / name).read_bytes())
    )
    assert fresh.shape == committed.shape, STALE
    difference = float(np.mean(np.abs(fresh - committed)))
    assert difference < 1.0, STALE  # `difference` is the mean difference of the pixels, which are 0 to 255


def test_the_picture_of_the_page_is_not_stale():
    """Drawing the page again would take a minute. Instead, a fingerprint of the files that decide its look is
    compared with the fingerprint in the picture."""
    from PIL import Image, ImageSequence

    with Image.open(PICTURES / page.NAME) as moving:
        assert moving.info["xmp"].decode() == page.look_hash(), STALE
        assert sum(1 for _ in ImageSequence.Iterator(moving)) > 50
    assert (PICTURES / page.NAME).stat().st_size < 700_000


def test_drawings_are_small_and_fetch_nothing():
    for name, svg in checked_in().items():
        assert len(svg) < 30_000, name
        assert "@font-face" not in svg, name
        assert set(re.findall(r"https?://[^\"' ]+", svg)) == {"http://www.w3.org/2000/svg"}, name


@pytest.mark.parametrize(("machine", "prefix"), [("pico", "GP"), ("esp32", "")])
def test_the_wires_go_to_the_pins_of_the_settings(machine, prefix):
    """In the drawing the default pins are bold, and no other pin is. The page Install has the same pins as a table."""
    with simulator.Board(lambda t_s: (0, 0, 1, 0, 0, 0), machine=machine), FreshFirmware():
        from kickstand import setting_table as usual
    pins = [prefix + str(pin) for pin in (*usual.SENSOR_PINS, *usual.LCD_PINS, usual.BUTTON_PIN)]
    drawing = checked_in()[f"wiring_{machine}.svg"]
    assert sorted(re.findall(r'font-weight="bold"[^>]*>(?:\d+  )?(GP\d+|\d+)<', drawing)) == sorted(pins)
    (table,) = re.findall(
        r"table\(\"" + ("Rasp" if prefix else "ESP32") + r".*", (site.PAGE / "install.html").read_text()
    )
    assert re.findall(r"\"(?:GPIO )?(\w+)(?:, pin \d+)?\"", table)[-5:] == pins
