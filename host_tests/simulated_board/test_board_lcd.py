"""The model of an LCD: an HD44780 behind a PCF8574."""

from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.lcd import CLEAR_US, POWER_UP_US, Lcd

RS, E, LIGHT = 0x01, 0x04, 0x08
PORT_US = 90  # time of a byte at 100 kHz


def pins(lcd, value):
    lcd.write_byte(value)
    lcd.clock.advance(PORT_US)


def nibble(lcd, value, rs=0):
    """Send the high four bits of value, with a pulse of the enable line."""
    pins(lcd, value & 0xF0 | LIGHT | rs | E)
    pins(lcd, value & 0xF0 | LIGHT | rs)


def send(lcd, value, rs=0):
    nibble(lcd, value, rs)
    nibble(lcd, value << 4 & 0xF0, rs)


def ready():
    """Return a display that is on, in 4-bit mode with two lines, initialised as in figure 24 of the data sheet."""
    clock = Clock()
    lcd = Lcd(clock)
    clock.advance(POWER_UP_US)
    for wait_us in (4100, 100, 100):
        nibble(lcd, 0x30)
        clock.advance(wait_us)
    nibble(lcd, 0x20)
    for command in (0x28, 0x0C, 0x06):
        send(lcd, command)
    return lcd


def test_bytes_during_the_long_home_command_are_lost():
    lcd = ready()
    for letter in "abc":
        send(lcd, ord(letter), RS)
    send(lcd, 0x02)
    done_us = lcd.clock.now_us + CLEAR_US - PORT_US
    send(lcd, ord("x"), RS)
    assert lcd.lost == 2 and lcd.text()[0].startswith("abc")
    lcd.clock.advance(done_us - lcd.clock.now_us)
    send(lcd, ord("x"), RS)
    assert lcd.text()[0].startswith("xbc")


def test_each_change_of_a_letter_is_counted():
    lcd = ready()
    for letter, changed in (("a", True), ("a", False), ("b", True)):
        send(lcd, 0x80)
        before = lcd.changes
        send(lcd, ord(letter), RS)
        assert (lcd.changes > before) is changed


def test_each_bit_of_a_command_has_its_switch():
    for value, switches in ((0x0C, (True, False, False)), (0x0A, (False, True, False)), (0x09, (False, False, True))):
        lcd = ready()
        send(lcd, value)
        assert (lcd.on, lcd.cursor, lcd.blink) == switches
