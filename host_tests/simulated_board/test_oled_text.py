"""The text that is read from the pictures of the firmware on an OLED."""

from types import SimpleNamespace

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.fakes import framebuf
from kickstand_tools.simulated_board.oled import Oled
from support.board_access import on_board

METER = {
    "lean_deg": 0.0,
    "max_left_deg": 7.4,
    "max_right_deg": 38.0,
    "smooth_force": (0.0, 1.0, 0.0),
    "max_accel_g": 0.31,
    "max_brake_g": 0.92,
}


def read(page, recording=False, **changed):
    """Return the two lines that are read while an OLED shows a picture. page: name of a function of glance.py."""
    found = []

    def program(board):
        from kickstand.ui import glance

        function, *values = getattr(glance, page)(SimpleNamespace(**(METER | changed)), recording)
        memory = bytearray(1024)
        function(framebuf.FrameBuffer(memory, 128, 64, framebuf.MONO_VLSB), *values)
        found.extend(shown(memory))

    assert on_board(program)[0] == "returned"
    return found


def shown(memory, height=64):
    oled = Oled(Clock())
    oled.start(oled.address, False)
    for value in (0x00, 0xA8, height - 1, 0x8D, 0x14, 0xAF):
        oled.write_byte(value)
    oled.ram[: len(memory)] = memory
    return oled.text()


@pytest.mark.parametrize(
    ("lean_deg", "recording", "line"),
    [
        (-12.0, False, "Lean  12° left  "),
        (5.0, False, "Lean   5° right "),
        (48.0, True, "Lean  48° right*"),
        (0.0, False, "Lean   0°       "),
        (0.0, True, "Lean   0°      *"),
    ],
)
def test_a_lean_is_read_with_its_side(lean_deg, recording, line):
    assert read("lean", recording, lean_deg=lean_deg) == [line, " " * 16]


@pytest.mark.parametrize(("left", "right"), [(7.4, 38.0), (41.0, 9.0), (0.0, 0.0), (12.0, 45.0)])
def test_both_maxima_are_read(left, right):
    lines = read("maxima", max_left_deg=left, max_right_deg=right)
    assert lines == [f"Max left   {left:3.0f}° ", f"Max right  {right:3.0f}° "]


@pytest.mark.parametrize(("forward_g", "line"), [(0.25, "0.25 g"), (-0.61, "0.61 g"), (1.07, "1.07 g")])
def test_an_acceleration_is_read_with_its_hundredths(forward_g, line):
    first, second = read("acceleration", smooth_force=(0.0, 1.0, forward_g))
    assert first.rstrip().endswith(line) and first[0].isupper()
    assert second.startswith("pk") and "0.31" in second and "0.92" in second


def test_a_dark_or_unknown_picture_has_no_text():
    assert shown(bytes([0x5A] * 1024))[0].rstrip() == "?" and shown(bytes([0x5A] * 1024), 32) == ["?", "?"]
    assert Oled(Clock()).text() == [" " * 16] * 2
    assert shown(bytes(1024)) == [" " * 16] * 2  # an empty picture consists of blanks


@pytest.mark.parametrize(("height", "rows"), [(64, (8, 40)), (32, (0, 16))])
def test_tall_letters_are_read_line_by_line(height, rows):
    """A letter is twice as high as that of framebuf."""
    memory = bytearray(1024)
    canvas = framebuf.FrameBuffer(memory, 128, 64, framebuf.MONO_VLSB)
    for text, top in zip(("Raw 0123456 +-", "%z{}~"), rows):
        small = framebuf.FrameBuffer(bytearray(128), 128, 8, framebuf.MONO_VLSB)
        small.text(text, 0, 0)
        for y in range(16):
            for x in range(128):
                canvas.pixel(x, top + y, small.pixel(x, y // 2))
    assert shown(memory, height) == ["Raw 0123456 +-  ", "%z{}~           "]
