"""The pictures in the documents match the current firmware, settings and commands."""

import io
import re
from pathlib import Path

import numpy as np
import pytest
from kickstand_workshop.pictures import drawn, explained, page, ride

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "tools" / "pictures"
STALE = "stale: run .venv/bin/python -m kickstand_workshop.pictures, look at the pictures, check them in"


def checked_in():
    return {path.name: path.read_text(encoding="utf-8") for path in PICTURES.glob("*.svg")}


@pytest.mark.long  # device and demo run to draw their displays
def test_no_drawing_is_stale():
    drawings, committed = drawn.drawn(), checked_in()
    stale = [name for name, svg in drawings.items() if committed.get(name) != svg]
    assert not stale and drawings.keys() == committed.keys(), f"{', '.join(stale)}: {STALE}"


@pytest.mark.long  # each case draws a ride; host_tests/analysis tests the content of plots
@pytest.mark.parametrize(("name", "draw"), [("ride.png", ride.draw), ("lean_compared.png", explained.lean_compared)])
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
        assert moving.info["xmp"].decode() == page.looks(), STALE
        assert sum(1 for _ in ImageSequence.Iterator(moving)) > 50
    assert (PICTURES / page.NAME).stat().st_size < 700_000


def test_drawings_are_small_and_fetch_nothing():
    for name, svg in checked_in().items():
        assert len(svg) < 30_000, name
        assert "@font-face" not in svg, name
        assert set(re.findall(r"https?://[^\"' ]+", svg)) == {"http://www.w3.org/2000/svg"}, name


def test_the_wires_go_to_the_pins_of_the_settings():
    """The default pins of both boards are bold. No other pin is bold."""
    for name, pins in (("pico", {"GP4", "GP5", "GP6", "GP7", "GP15"}), ("esp32", {"21", "22", "18", "19", "4"})):
        bold = re.findall(r'font-weight="bold"[^>]*>(?:\d+  )?(GP\d+|\d+)<', checked_in()[f"wiring_{name}.svg"])
        assert set(bold) == pins
