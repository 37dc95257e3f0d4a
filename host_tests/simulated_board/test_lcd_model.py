"""The model of the LCD by the data sheet of the HD44780: memory, address counter, times, patterns, and backpacks."""

import pytest
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.lcd import Lcd

RS, E, LIGHT = 0x01, 0x04, 0x08


def nibble(lcd, value, rs=0):
    """Send half a byte. RS is stable before E rises."""
    lcd.write_byte(value & 0xF0 | LIGHT | rs)
    for pins in (value & 0xF0 | LIGHT | rs | E, value & 0xF0 | LIGHT | rs):
        lcd.write_byte(pins)
        lcd.clock.advance(90)


def send(lcd, *values, rs=0):
    for value in values:
        nibble(lcd, value, rs)
        nibble(lcd, value << 4 & 0xF0, rs)


def new_lcd(lines=2):
    """Return a display that is on, in 4-bit mode, initialised as in figure 24 of the data sheet."""
    lcd = Lcd(Clock())
    lcd.clock.advance(40_000)
    for wait_us in (4100, 100, 100):
        nibble(lcd, 0x30)
        lcd.clock.advance(wait_us)
    nibble(lcd, 0x20)
    send(lcd, 0x28 if lines == 2 else 0x20, 0x0C, 0x06)
    return lcd


def write(lcd, text, *commands):
    send(lcd, *commands)
    send(lcd, *text.encode(), rs=RS)
    return lcd


def test_rs_must_be_stable_before_e_rises():
    """A letter whose RS rises together with E arrives as a command (tAS of the data sheet)."""
    lcd = new_lcd()
    for half in (0x40, 0x10):
        lcd.write_byte(half | LIGHT)
        lcd.write_byte(half | LIGHT | RS | E)
        lcd.write_byte(half | LIGHT | RS)
        lcd.clock.advance(90)
    assert lcd.text()[0] == " " * 16
    assert write(lcd, "A", 0x80).text()[0].startswith("A")


@pytest.mark.parametrize(
    ("lines", "writes", "shown"),
    [
        (2, [(0x80, "0123456789abcdefXY"), (0xC0, "second")], ["0123456789abcdef", "second"]),
        (1, [(0x80, "one"), (0xC0, "two")], ["one", ""]),
        (2, [(0x80, "0123456789abcdefXY"), (0x18, "")], ["123456789abcdefX", ""]),  # the text moves left
        (2, [(0x80, "0123456789abcdefXY"), (0x1C, "")], [" 0123456789abcde", ""]),  # right
        (2, [(0x80, "abc"), (0x18, ""), (0x02, "")], ["abc", ""]),  # home
        (2, [(0x07, ""), (0x80, "ab")], ["", ""]),  # each character shifts the text
        (2, [(0x80, "ab"), (0x08, "")], ["", ""]),  # off
        (2, [(0x80, "ab"), (0x08, ""), (0x0F, "")], ["ab", ""]),
        (2, [(0x04, ""), (0x85, "abc"), (0x01, ""), (0x06, "xy")], ["xy", ""]),  # clear
    ],
)
def test_what_is_shown_after_commands_and_text(lines, writes, shown):
    lcd = new_lcd(lines)
    for command, text in writes:
        send(lcd, command)
        lcd.clock.advance(1520)
        write(lcd, text)
    assert lcd.text() == [line.ljust(16) for line in shown]


def test_patterns_are_drawn_in_eight_characters():
    """Character 3 becomes a block, and an address past the last row wraps to the first."""
    lcd = new_lcd()
    send(lcd, 0x40 | 3 << 3)
    send(lcd, *[0x1F] * 8, rs=RS)
    send(lcd, 0x80)
    send(lcd, 3, 11, rs=RS)
    assert lcd.text()[0].startswith("██") and list(lcd.cgram[24:32]) == [0x1F] * 8 and not any(lcd.cgram[:24])
    send(lcd, 0x40 | 63)
    send(lcd, 1, 2, rs=RS)
    assert (lcd.cgram[63], lcd.cgram[0]) == (1, 2)
