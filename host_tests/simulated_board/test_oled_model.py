"""The model of the OLEDs by the data sheets, and the text that is read from their pixels."""

from collections import namedtuple

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.fakes import framebuf
from kickstand_tools.simulated_board.oled import Oled
from support.board_access import on_board

SUPPLY = {"ssd1306": (0x8D, 0x14), "sh1106": (0xAD, 0x8B)}


def send(oled, *values):
    oled.start(oled.address, False)
    for value in values:
        assert oled.write_byte(value)


def commands(oled, *values):
    send(oled, 0x00, *values)


def new_oled(kind="ssd1306", *values):
    """Return a display that is on and blank."""
    oled = Oled(Clock(), kind=kind)
    commands(oled, *SUPPLY[kind], 0xAF, *values)
    oled.ram[:] = bytes(len(oled.ram))
    return oled


@pytest.mark.parametrize(
    ("kind", "settings", "values", "stored"),
    [
        # Page addressing stays within its page. An SH1106 stays at its last column.
        ("ssd1306", (0xB2, 0x0E, 0x17), (1, 2, 3), {(2, 126): 1, (2, 127): 2, (2, 0): 3}),
        ("sh1106", (0xB7, 0x02, 0x18), (1, 2, 3), {(7, 130): 1, (7, 131): 3}),
        # Horizontal and vertical addressing use a window, at first the whole memory
        ("ssd1306", (0x20, 0, 0x21, 126, 127, 0x22, 6, 7), (1, 2, 3, 4, 5),
         {(6, 126): 5, (6, 127): 2, (7, 126): 3, (7, 127): 4}),
        ("ssd1306", (0x20, 1, 0x21, 5, 6, 0x22, 1, 2), (1, 2, 3, 4, 5),
         {(1, 5): 5, (2, 5): 2, (1, 6): 3, (2, 6): 4}),
        # The commands for page and column act only in page addressing
        ("ssd1306", (0x20, 0, 0x05, 0x13), (9,), {(0, 0): 9}),
    ],
)  # fmt: skip
def test_where_bytes_are_stored(kind, settings, values, stored):
    oled = new_oled(kind, *settings)
    send(oled, 0x40, *values)
    assert {divmod(k, len(oled.ram) // 8): value for k, value in enumerate(oled.ram) if value} == stored


def lit(oled):
    """Return the lit pixels as (row, column)."""
    return [
        (k // 16, 8 * (k % 16) + bit) for k, byte in enumerate(oled.pixels()) for bit in range(8) if byte << bit & 0x80
    ]


@pytest.mark.parametrize("kind", ["ssd1306", "sh1106"])
def test_a_pixel_is_where_the_settings_put_it(kind):
    """Modules are mounted with rows and columns reversed, so their drivers send 0xA1 and 0xC8."""
    oled = new_oled(kind, 0xA1, 0xC8, 0xB1, 0x03 + (2 if kind == "sh1106" else 0), 0x10)
    send(oled, 0x40, 0b100)
    for settings, pixels in (
        ((), [(10, 3)]),
        ((0xA0,), [(10, 124)]),
        ((0xC0,), [(53, 124)]),
        ((0xA1, 0xC8, 0x44), [(6, 3)]),  # the picture begins at row 4
        ((0x40, 0xD3, 60), [(14, 3)]),
        ((0xD3, 0, 0xA8, 31), [(10, 3)]),
        ((0xA8, 9), []),  # the panel drives only the first ten rows
        ((0xA8, 10), [(10, 3)]),
    ):
        commands(oled, *settings)
        assert lit(oled) == pixels, settings


@pytest.mark.parametrize(("kind", "off", "contrast", "status"), [("ssd1306", 0x10, 0x7F, 3), ("sh1106", 0x8A, 0x80, 8)])
def test_power_supply_status_and_changes(kind, off, contrast, status):
    """A panel is dark without its own supply. After power-on the memory has arbitrary content."""
    oled = Oled(Clock(), kind=kind)
    assert (oled.contrast, oled.rows, oled.alternate, oled.on) == (contrast, 64, True, False)
    noise = bytes(oled.ram)
    oled.power_on()
    assert any(noise) and bytes(oled.ram) != noise and oled.read_byte() == 0x40 | status
    for values, shines, on in (
        ((0xAF,), False, True),
        ((0xAE, *SUPPLY[kind], 0xAF), True, True),
        ((0xAE, SUPPLY[kind][0], off, 0xAF), False, True),
        ((0xAE,), False, False),
    ):
        commands(oled, *values)
        assert (oled.backlight, oled.read_byte() & 0x40 == 0) == (shines, on), values
    oled = new_oled(kind)
    for value, changed in ((0x81, 1), (0x81, 0)):
        commands(oled, 0xB0, 0x00, 0x10)
        changes = oled.changes
        send(oled, 0x40, value)
        assert oled.changes - changes == changed
    changes = oled.changes
    oled.power_off()
    assert not oled.on and oled.changes == changes + 1


def text_of(memory, height=64):
    """Return the two lines that are read from an OLED with this memory."""
    oled = Oled(Clock())
    commands(oled, 0xA8, height - 1, *SUPPLY["ssd1306"], 0xAF)
    oled.ram[: len(memory)] = memory
    return oled.text()


Meter = namedtuple("Meter", "lean_deg max_left_deg max_right_deg smooth_force max_accel_g max_brake_g")


@pytest.mark.parametrize(
    ("page", "recording", "meter", "lines"),
    [
        ("lean", False, (-12.0, 0, 0), ["Lean  12° left  ", " " * 16]),
        ("lean", True, (48.0, 0, 0), ["Lean  48° right*", " " * 16]),
        ("lean", False, (0.0, 0, 0), ["Lean   0°       ", " " * 16]),
        ("lean", True, (0.0, 0, 0), ["Lean   0°      *", " " * 16]),
        ("maxima", False, (0.0, 7.4, 38.0), ["Max left     7° ", "Max right   38° "]),
        ("maxima", False, (0.0, 41.0, 9.0), ["Max left    41° ", "Max right    9° "]),
        ("acceleration", False, (0.0, 0, 0, 0.25), ["Accel    0.25 g ", "pk +0.31 / -0.92"]),
        ("acceleration", False, (0.0, 0, 0, -0.61), ["Brake    0.61 g ", "pk +0.31 / -0.92"]),
        ("acceleration", False, (0.0, 0, 0, 1.07), ["Accel    1.07 g ", "pk +0.31 / -0.92"]),
    ],
)
def test_the_firmwares_pictures_are_read(page, recording, meter, lines):
    def program(board):
        from kickstand.ui import glance

        lean, left, right, forward_g = (*meter, 0.0)[:4]
        function, *values = getattr(glance, page)(
            Meter(lean, left, right, (0.0, 1.0, forward_g), 0.31, 0.92), recording
        )
        memory = bytearray(1024)
        function(framebuf.FrameBuffer(memory, 128, 64, framebuf.MONO_VLSB), *values)
        shown.extend(text_of(memory))

    shown = []
    assert on_board(program)[0] == "returned"
    assert shown == lines


def test_a_dark_or_unknown_picture_has_no_text():
    assert text_of(bytes([0x5A] * 1024))[0].rstrip() == "?" and text_of(bytes([0x5A] * 1024), 32) == ["?", "?"]
    assert Oled(Clock()).text() == text_of(bytes(1024)) == [" " * 16] * 2
