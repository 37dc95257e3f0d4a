"""The HD44780 behind its PCF8574. Also run under MicroPython."""

from kickstand_tools.simulated_board import glyphs
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.lcd import CLEAR_US, POWER_UP_US, Lcd

RS, E, LIGHT = 0x01, 0x04, 0x08
PORT_US = 90  # a byte at 100 kHz


def pins(lcd, value):
    lcd.write_byte(value)
    lcd.clock.advance(PORT_US)


def nibble(lcd, value, rs=0):
    """The high four bits of value, strobed."""
    pins(lcd, value & 0xF0 | LIGHT | rs | E)
    pins(lcd, value & 0xF0 | LIGHT | rs)


def send(lcd, value, rs=0):
    nibble(lcd, value, rs)
    nibble(lcd, value << 4 & 0xF0, rs)


def wake(lcd):
    """The data sheet's initialisation by instruction, figure 24."""
    for wait_us in (4100, 100, 100):
        nibble(lcd, 0x30)
        lcd.clock.advance(wait_us)
    nibble(lcd, 0x20)
    for command in (0x28, 0x0C, 0x06):
        send(lcd, command)


def ready():
    """A display that is on, in 4-bit mode with two lines."""
    clock = Clock()
    lcd = Lcd(clock)
    clock.advance(POWER_UP_US)
    wake(lcd)
    return lcd


def write(lcd, line, text):
    send(lcd, 0x80 | 0x40 * line)
    for character in text:
        send(lcd, character if isinstance(character, int) else ord(character), RS)


def test_two_lines_of_text():
    lcd = ready()
    write(lcd, 0, "Lean  23\xdf right")
    write(lcd, 1, "0123456789ABCDEF")
    assert lcd.text() == ["Lean  23\u00b0 right ", "0123456789ABCDEF"]
    assert lcd.lost == 0 and lcd.backlight


def test_home_takes_long_and_what_comes_meanwhile_is_lost():
    lcd = ready()
    write(lcd, 0, "abc")
    send(lcd, 0x02)
    done_us = lcd.clock.now_us + CLEAR_US - PORT_US
    send(lcd, ord("x"), RS)
    assert lcd.lost == 2 and lcd.text()[0].startswith("abc")
    lcd.clock.advance(done_us - lcd.clock.now_us)
    send(lcd, ord("x"), RS)
    assert lcd.text()[0].startswith("xbc")


def test_own_characters():
    lcd = ready()
    send(lcd, 0x40 | 8 * 2)
    for _ in range(8):
        send(lcd, 0x18, RS)
    send(lcd, 0x40 | 8 * 7)
    for _ in range(8):
        send(lcd, 0x01, RS)
    write(lcd, 0, [2, 7, 10, 0])
    assert lcd.text()[0][:4] == "\u258d\u2595\u258d "
    assert lcd.glyphs[2] == "\u258d"


def test_patterns_as_text():
    def column(bits):
        return [bits] * 8

    left = [glyphs.drawn(column(0x1F & ~(0x1F >> k))) for k in range(1, 6)]
    assert left == ["\u258e", "\u258d", "\u258b", "\u258a", "\u2588"]
    right = [glyphs.drawn(column((1 << k) - 1)) for k in range(1, 5)]
    assert right == ["\u2595", "\u2590", "\u2590", "\u2590"]
    assert glyphs.drawn([0] * 8) == " "
    assert glyphs.drawn([0] * 5 + [0x1F] * 3) == "\u2583"
    assert glyphs.drawn([0] + [0x1C] * 6 + [0]) == "\u258b"
    assert glyphs.drawn(column(0x04)) == "|"
    assert glyphs.drawn([0x04, 0x0E, 0x15, 0x04, 0x04, 0x04, 0x04, 0x00]) == "?"
