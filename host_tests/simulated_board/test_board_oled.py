"""Tests the simulated OLED controllers and the simulated framebuf, also on MicroPython."""

import sys

from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.fakes import framebuf as fake
from kickstand_tools.simulated_board.oled import Oled

KINDS = ("ssd1306", "sh1106")
SUPPLY = {"ssd1306": (0x8D, 0x14), "sh1106": (0xAD, 0x8B)}
FIRST = {"ssd1306": 0, "sh1106": 2}


def send(oled, control, *values):
    oled.start(oled.address, False)
    assert oled.write_byte(control)
    for value in values:
        assert oled.write_byte(value)


def ready(kind):
    """Return a display that is on, upright and blank."""
    oled = Oled(Clock(), kind=kind)
    send(oled, 0x00, *SUPPLY[kind], 0xA1, 0xC8, 0xAF)
    for page in range(8):
        send(oled, 0x00, 0xB0 | page, 0x00, 0x10)
        send(oled, 0x40, *([0] * 132))
        send(oled, 0x00, 0x00, 0x10)
    return oled


def lit(oled):
    """Return (x, y) of every lit pixel."""
    pixels = oled.pixels()
    return [(i % 128, i // 128) for i in range(8192) if pixels[i >> 3] & 0x80 >> (i & 7)]


def test_a_byte_is_eight_rows_of_a_column():
    for kind in KINDS:
        oled = ready(kind)
        send(oled, 0x00, 0xB2, FIRST[kind], 0x10)
        send(oled, 0x40, 0x81, 0x01)
        assert lit(oled) == [(0, 16), (1, 16), (0, 23)], (kind, lit(oled))
        send(oled, 0x00, 0x42)
        assert lit(oled) == [(0, 14), (1, 14), (0, 21)]


def test_the_fake_framebuf_draws_as_micropython_s_own():
    """On CPython, without MicroPython's framebuf, the test only checks simple drawings."""
    module = fake
    if sys.implementation.name == "micropython":
        import framebuf as module  # pyright: ignore[reportMissingImports]
    drawn = []
    for each in (module, fake):
        pixels, stamp = bytearray(1024), bytearray(24 * 40 // 8)
        canvas = each.FrameBuffer(pixels, 128, 64, each.MONO_VLSB)
        picture = each.FrameBuffer(stamp, 24, 40, each.MONO_HLSB)
        picture.rect(1, 2, 20, 30, 1)
        picture.line(23, 0, 0, 39, 1)
        canvas.text("Lean 23 \x7e\x7f~g", 3, 5, 1)
        canvas.fill_rect(50, 40, 200, 10, 1)
        canvas.rect(-3, 50, 20, 30, 1)
        canvas.blit(picture, 30, 20, 0)
        canvas.blit(picture, 110, 50)
        canvas.vline(127, -5, 100, 1)
        canvas.hline(100, 30, 5, 1)
        canvas.text("dark", 60, 41, 0)
        for end in ((0, 63), (127, 63), (127, 20), (64, 0), (0, 33), (90, 32)):
            canvas.line(64, 32, *end, 1)
        canvas.pixel(5, 45, 1)
        assert canvas.pixel(5, 45) == 1 and canvas.pixel(5, 46) == 0 and canvas.pixel(500, 1) is None
        drawn.append(bytes(pixels))
    assert drawn[0] == drawn[1], [i for i in range(1024) if drawn[0][i] != drawn[1][i]]
