"""The models of the displays by the data sheets: memory and address counter of an LCD, addressing of an OLED."""

import pytest
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.glyphs import drawn, rom
from kickstand_tools.simulated_board.lcd import Lcd, shown_lean
from kickstand_tools.simulated_board.oled import Oled

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
        (2, 0x27, 0x06, 0x40),  # the end of the first line
        (2, 0x67, 0x06, 0x00),  # the end of the second line
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
    send(made, 0x1C, 0x1C)  # the text moves right; the end of the line is before its start
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
    for half in (0x4, 0x1):  # the letter A
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
        ([0xE0] * 8, " "),  # only five dots of a row exist
    ],
)
def test_patterns_look_like_letters(rows, letter):
    assert drawn(rows) == letter


def test_the_letters_of_the_rom():
    codes = (0x41, 0x5C, 0x7D, 0x7E, 0x7F, 0x80, 0xA0, 0xA1, 0xDF, 0xFF, 0x1F)
    assert "".join(map(rom, codes)) == "A¥}→←  ?°█ "


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
    assert places(other, 132) == {(7, 130): 1, (7, 131): 3}  # it stays at its last column


def test_horizontal_and_vertical_addressing_use_a_window():
    made = oled("ssd1306", 0x20, 0, 0x21, 126, 127, 0x22, 6, 7)
    store(made, 1, 2, 3, 4, 5)
    assert places(made) == {(6, 126): 5, (6, 127): 2, (7, 126): 3, (7, 127): 4}
    made = oled("ssd1306", 0x20, 1, 0x21, 5, 6, 0x22, 1, 2)
    store(made, 1, 2, 3, 4, 5)
    assert places(made) == {(1, 5): 5, (2, 5): 2, (1, 6): 3, (2, 6): 4}
    made = oled("ssd1306", 0x20, 0)  # the whole memory at first
    store(made, *range(1, 130))
    assert (made.ram[127], made.ram[128]) == (128, 129)
    order(made, 0x05, 0x13)  # these commands act only in page addressing
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
    assert lit(made) == []  # only the first ten rows are driven
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
        assert not made.on and any(made.ram)  # its memory has arbitrary content
        first = bytes(made.ram)
        made.power_on()
        assert bytes(made.ram) != first
        made = oled(kind, 0xAF)
        before = made.changes
        made.power_off()
        assert not made.on and made.changes == before + 1
