"""The model of the OLEDs by the data sheets, and the text that is read from their pixels."""

import pytest
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.oled import Oled

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


def test_a_dark_or_unknown_picture_has_no_text():
    assert text_of(bytes([0x5A] * 1024))[0].rstrip() == "?" and text_of(bytes([0x5A] * 1024), 32) == ["?", "?"]
    assert Oled(Clock()).text() == text_of(bytes(1024)) == [" " * 16] * 2
