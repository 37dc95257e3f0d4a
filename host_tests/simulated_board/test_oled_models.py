"""The model of the OLEDs by the data sheets: addressing, and where a stored pixel is seen."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.oled import Oled


def oled(kind="ssd1306", *commands):
    made = Oled(Clock(), kind=kind)
    order(made, *((0x8D, 0x14) if kind == "ssd1306" else (0xAD, 0x8B)), 0xAF, *commands)
    made.ram[:] = bytes(len(made.ram))
    return made


def order(made, *commands):
    made.start(made.address, False)
    for value in (0x00, *commands):
        made.write_byte(value)


def store(made, *values):
    made.start(made.address, False)
    for value in (0x40, *values):
        made.write_byte(value)


def places(made, columns=128):
    """Return the stored bytes as {(page, column): value}."""
    return {divmod(k, columns): value for k, value in enumerate(made.ram) if value}


def test_page_addressing_stays_within_its_page():
    made = oled("ssd1306", 0xB2, 0x0E, 0x17)
    store(made, 1, 2, 3)
    assert places(made) == {(2, 126): 1, (2, 127): 2, (2, 0): 3}
    other = oled("sh1106", 0xB7, 0x02, 0x18)
    store(other, 1, 2, 3)
    assert places(other, 132) == {(7, 130): 1, (7, 131): 3}  # the address stays at the last column


def test_horizontal_and_vertical_addressing_use_a_window():
    made = oled("ssd1306", 0x20, 0, 0x21, 126, 127, 0x22, 6, 7)
    store(made, 1, 2, 3, 4, 5)
    assert places(made) == {(6, 126): 5, (6, 127): 2, (7, 126): 3, (7, 127): 4}
    made = oled("ssd1306", 0x20, 1, 0x21, 5, 6, 0x22, 1, 2)
    store(made, 1, 2, 3, 4, 5)
    assert places(made) == {(1, 5): 5, (2, 5): 2, (1, 6): 3, (2, 6): 4}
    made = oled("ssd1306", 0x20, 0)  # at first the window is the whole memory
    store(made, *range(1, 130))
    assert (made.ram[127], made.ram[128]) == (128, 129)
    order(made, 0x05, 0x13)  # the commands for page and column act only in page addressing
    store(made, 99)
    assert places(made)[1, 1] == 99


def lit(made):
    """Return the places of the lit pixels as (row, column)."""
    return [
        (k // 16, 8 * (k % 16) + bit) for k, byte in enumerate(made.pixels()) for bit in range(8) if byte << bit & 0x80
    ]


@pytest.mark.parametrize("kind", ["ssd1306", "sh1106"])
def test_a_pixel_is_where_the_settings_put_it(kind):
    """Modules are mounted with rows and columns reversed, so their drivers send 0xA1 and 0xC8."""
    made = oled(kind, 0xA1, 0xC8, 0xB1, 0x03 + (2 if kind == "sh1106" else 0), 0x10)
    store(made, 0b100)
    assert lit(made) == [(10, 3)]
    order(made, 0xA0)
    assert lit(made) == [(10, 124)]
    order(made, 0xC0)
    assert lit(made) == [(53, 124)]
    order(made, 0xA1, 0xC8, 0x44)
    assert lit(made) == [(6, 3)]  # the picture begins at row 4
    order(made, 0x40, 0xD3, 60)
    assert lit(made) == [(14, 3)]
    order(made, 0xD3, 0, 0xA8, 31)
    assert lit(made) == [(10, 3)] and made.rows == 32
    order(made, 0xA8, 9)
    assert lit(made) == []  # the panel drives only the first ten rows
    order(made, 0xA8, 10)
    assert lit(made) == [(10, 3)]


def test_a_picture_can_be_inverted_or_all_lit():
    made = oled("ssd1306", 0xA1, 0xC8, 0xB0, 0x00, 0x10)
    store(made, 1)
    order(made, 0xA7)
    assert made.inverted and len(lit(made)) == 128 * 64 - 1 and (0, 0) not in lit(made)
    order(made, 0xA6, 0xA5)
    assert len(lit(made)) == 128 * 64
    order(made, 0xA4, 0xAE)
    assert lit(made) == [] and not made.backlight


def test_one_byte_may_follow_a_control_byte():
    """With the bit Co, each command or data byte has its own control byte."""
    made = oled()
    made.start(made.address, False)
    for value in (0x80, 0xB3, 0x80, 0x02, 0x80, 0x10, 0xC0, 7, 0x40, 8, 9):
        made.write_byte(value)
    assert places(made) == {(3, 2): 7, (3, 3): 8, (3, 4): 9}


def test_the_settings_after_a_reset():
    for kind, contrast, status_off in (("ssd1306", 0x7F, 0x43), ("sh1106", 0x80, 0x48)):
        made = Oled(Clock(), kind=kind)
        assert (made.contrast, made.read_byte(), made.rows, made.alternate) == (contrast, status_off, 64, True)
        assert not made.on and any(made.ram)  # after power-on the memory has arbitrary content
        first = bytes(made.ram)
        made.power_on()
        assert bytes(made.ram) != first
        made = oled(kind, 0xAF)
        before = made.changes
        made.power_off()
        assert not made.on and made.changes == before + 1
