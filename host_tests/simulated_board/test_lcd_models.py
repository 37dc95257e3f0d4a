"""The model of the LCD by the data sheet: memory, address counter, times, patterns, and backpacks."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.glyphs import drawn, rom
from kickstand_tools.simulated_board.lcd import Lcd, shown_lean

RS, RW, E, LIGHT = 0x01, 0x02, 0x04, 0x08


def nibble(lcd, value, rs=0):
    for pins in (value & 0xF0 | LIGHT | rs | E, value & 0xF0 | LIGHT | rs):
        lcd.write_byte(pins)
        lcd.clock.advance(90)


def send(lcd, *values, rs=0):
    for value in values:
        nibble(lcd, value, rs)
        nibble(lcd, value << 4 & 0xF0, rs)


def lcd(lines=2):
    """Return a display that is on, in 4-bit mode, initialised as in figure 24 of the data sheet."""
    made = Lcd(Clock())
    made.clock.advance(40_000)
    for wait_us in (4100, 100, 100):
        nibble(made, 0x30)
        made.clock.advance(wait_us)
    nibble(made, 0x20)
    send(made, 0x28 if lines == 2 else 0x20, 0x0C, 0x06)
    return made


def written(made, text, *commands):
    send(made, *commands)
    send(made, *text.encode(), rs=RS)
    return made


def status(made):
    """Read the busy flag and the address counter."""
    halves = []
    for _ in range(2):
        made.write_byte(0xF0 | LIGHT | RW | E)
        halves.append(made.read_byte() & 0xF0)
        made.write_byte(0xF0 | LIGHT | RW)
    return halves[0] | halves[1] >> 4


@pytest.mark.parametrize(
    ("lines", "begin", "direction", "after"),
    [
        (2, 0x00, 0x06, 0x01),
        (2, 0x27, 0x06, 0x40),  # at the end of the first line
        (2, 0x67, 0x06, 0x00),  # at the end of the second line
        (2, 0x40, 0x04, 0x27),  # backwards
        (2, 0x00, 0x04, 0x67),
        (1, 0x27, 0x06, 0x28),
        (1, 0x4F, 0x06, 0x00),
        (1, 0x00, 0x04, 0x4F),
    ],
)
def test_the_address_counter_wraps_at_the_ends_of_lines(lines, begin, direction, after):
    made = written(lcd(lines), "x", direction, 0x80 | begin)
    made.clock.advance(100)
    assert status(made) == after
    send(made, 0x80 | begin, 0x14 if direction == 0x06 else 0x10)  # the command that moves the cursor
    made.clock.advance(100)
    assert status(made) == after


def test_both_lines_are_visible_from_their_first_characters():
    made = written(written(lcd(), "0123456789abcdefXY", 0x80), "second", 0xC0)
    assert made.text() == ["0123456789abcdef", "second".ljust(16)]
    assert made.codes()[1][:2] == [ord("s"), ord("e")]
    one_line = written(written(lcd(1), "one", 0x80), "two", 0xC0)
    assert one_line.text() == ["one".ljust(16), " " * 16]


def test_the_display_shifts_against_its_text():
    made = written(lcd(), "0123456789abcdefXY", 0x80)
    send(made, 0x18)  # the text moves left
    assert made.text()[0] == "123456789abcdefX"
    send(made, 0x1C, 0x1C)  # the text moves right, so the end of the line is shown before its beginning
    assert made.text()[0] == " 0123456789abcde"
    send(made, 0x02)
    made.clock.advance(1520)
    assert made.text()[0] == "0123456789abcdef"
    shifting = written(lcd(), "ab", 0x80, 0x07)  # each character shifts the text
    assert shifting.codes()[0][:2] == [0x20, 0x20] and shifting.text()[0].strip() == ""


def test_clear_empties_the_memory_and_counts_up_again():
    made = written(lcd(), "abc", 0x04, 0x85)
    send(made, 0x01)
    made.clock.advance(1520)
    assert status(made) == 0 and made.text() == [" " * 16] * 2
    assert written(made, "ab").text()[0].startswith("ab")


def test_the_display_is_blank_while_off():
    made = written(lcd(), "abc", 0x80)
    before = made.changes
    send(made, 0x08)
    assert (made.on, made.text(), made.changes) == (False, [" " * 16] * 2, before + 1)
    send(made, 0x0F)
    assert (made.on, made.cursor, made.blink) == (True, True, True) and made.text()[0].startswith("abc")
    send(made, 0x0D)
    assert (made.on, made.cursor, made.blink) == (True, False, True)


def test_the_backlight_is_a_pin_of_its_own():
    made = lcd()
    before = made.changes
    made.write_byte(0x00)
    assert not made.backlight and made.changes == before + 1
    made.write_byte(0x00)
    assert made.changes == before + 1
    made.write_byte(LIGHT)
    assert made.backlight and made.changes == before + 2


def test_patterns_are_drawn_in_eight_characters():
    """Character 3 becomes a block, and an address past the last row wraps to the first."""
    made = lcd()
    send(made, 0x40 | 3 << 3)
    send(made, *[0x1F] * 8, rs=RS)
    send(made, 0x80)
    send(made, 3, 11, rs=RS)
    assert made.text()[0].startswith("██") and list(made.cgram[24:32]) == [0x1F] * 8 and not any(made.cgram[:24])
    send(made, 0x40 | 63)
    send(made, 1, 2, rs=RS)
    assert (made.cgram[63], made.cgram[0]) == (1, 2)


@pytest.mark.parametrize(("wait_us", "lost"), [(39_999, 1), (40_000, 0)])
def test_a_display_needs_40_ms_after_power_on(wait_us, lost):
    made = Lcd(Clock())
    made.write_byte(0x30 | E)
    made.clock.advance(wait_us)
    made.write_byte(0x30)
    assert made.lost == lost


@pytest.mark.parametrize(
    ("command", "wait_us", "lost"),
    [(0x0C, 36, 1), (0x0C, 37, 0), (0x01, 1519, 1), (0x01, 1520, 0), (0x02, 1519, 1), (0x80, 37, 0)],
)
def test_each_command_has_its_time(command, wait_us, lost):
    made = lcd()
    send(made, 0x80)
    nibble(made, command)
    made.write_byte(command << 4 & 0xF0 | E)
    made.write_byte(command << 4 & 0xF0)
    made.write_byte(0x80 | E)
    made.clock.advance(wait_us)
    made.write_byte(0x80)
    assert made.lost == lost


@pytest.mark.parametrize(("wait_us", "busy"), [(40, True), (41, False)])
def test_a_character_takes_41_us(wait_us, busy):
    made = lcd()
    nibble(made, ord("a"), RS)
    made.write_byte(0x10 | RS | E)
    made.write_byte(0x10 | RS)
    made.clock.advance(wait_us)
    made.write_byte(0xF0 | RW | E)
    assert bool(made.read_byte() & 0x80) is busy


@pytest.mark.parametrize("wake", [0, 1])
def test_the_first_wake_ups_take_longer(wake):
    made = Lcd(Clock())
    made.clock.advance(40_000)
    for wait_us in (4100, 100)[:wake]:
        nibble(made, 0x30)
        made.clock.advance(wait_us)
    made.write_byte(0x30 | E)
    made.write_byte(0x30)
    made.clock.advance((4100, 100)[wake] - 1)
    made.write_byte(0x30 | E)
    made.write_byte(0x30)
    assert made.lost == 1


@pytest.mark.parametrize(
    ("wiring", "rs", "enable", "light", "lit", "data"),
    [(2, 6, 4, 7, 0, 0), (3, 4, 6, 7, 1, 0), (4, 0, 2, 3, 0, 4)],
)
def test_other_backpacks_have_other_pins(wiring, rs, enable, light, lit, data):
    made = lcd()
    made.wiring = wiring
    send(made, 0x80)
    for half in (0x4, 0x1):  # the two halves of the code of the letter A
        for pulse in (1, 0):
            made.write_byte(half << data | 1 << rs | pulse << enable | lit << light)
            made.clock.advance(90)
    assert made.text()[0][0] == "A" and made.backlight
    made.write_byte((1 - lit) << light)
    assert not made.backlight and made.read_byte() == (1 - lit) << light


@pytest.mark.parametrize(
    ("line", "lean"),
    [
        ("Lean  12° left  ", -12.0),
        ("Lean   5° right*", 5.0),
        ("Lean   0°       ", 0.0),
        ("Lean  --        ", None),
        ("Max left    12° ", None),
    ],
)
def test_the_lean_of_the_lean_page(line, lean):
    assert shown_lean([line, ""]) == lean


@pytest.mark.parametrize(
    ("rows", "letter"),
    [
        ([0] * 8, " "),
        ([0x1F] * 8, "█"),
        ([0] * 7 + [0x1F], "▁"),
        ([0] * 4 + [0x1F] * 4, "▄"),
        ([0x10] * 8, "▎"),
        ([0x1E] * 8, "▊"),
        ([0x01] * 8, "▕"),
        ([0x0F] * 8, "▐"),
        ([0x04] * 8, "|"),
        ([0x08] * 8, "|"),
        ([0x02] * 8, "|"),
        ([0, 0x18, 0x18, 0x18, 0x18, 0x18, 0, 0], "▍"),  # a bar of five rows
        ([0, 0x18, 0x18, 0x18, 0x18, 0, 0, 0], "?"),
        ([0x0A] * 8, "?"),
        ([0x10, 0x18] * 4, "?"),
        ([0xE0] * 8, " "),  # a row has only five dots
    ],
)
def test_patterns_look_like_letters(rows, letter):
    assert drawn(rows) == letter


def test_the_letters_of_the_rom():
    codes = (0x41, 0x5C, 0x7D, 0x7E, 0x7F, 0x80, 0xA0, 0xA1, 0xDF, 0xFF, 0x1F)
    assert "".join(map(rom, codes)) == "A¥}→←  ?°█ "
