"""Models a 16x2 HD44780 character display on a PCF8574 backpack (HD44780U data sheet ADE-207-272).

The usual backpack has this wiring: P0 RS, P1 R/W, P2 E, P3 backlight, P4..P7 D4..D7. WIRINGS has other wirings. D0..D3
are not connected, so the controller reads them as ones. Data sent while the controller is busy is lost, as on the chip.
"""

import re

# Codes of ROM A00 that differ from ASCII and have a counterpart in Unicode (HD44780U data sheet, table 4)
_ROM_A00 = {
    0x5C: "\u00a5",  # yen
    0x7E: "\u2192",  # right arrow
    0x7F: "\u2190",  # left arrow
    0xA5: "\u00b7",  # middle dot
    0xDF: "\u00b0",  # degree
    0xE0: "\u03b1",  # alpha
    0xE2: "\u03b2",  # beta
    0xE4: "\u03bc",  # mu
    0xF2: "\u03b8",  # theta
    0xF4: "\u03a9",  # omega
    0xF6: "\u03a3",  # sigma
    0xF7: "\u03c0",  # pi
    0xFD: "\u00f7",  # division
    0xFF: "\u2588",  # full block
}

# The nearest Unicode block by number of filled columns or rows. Unicode has blocks in eighths, but a character has five
# columns.
_FROM_LEFT = " \u258e\u258d\u258b\u258a\u2588"
_FROM_RIGHT = " \u2595\u2590\u2590\u2590\u2588"  # at the right edge Unicode has only an eighth and a half block
_FROM_BELOW = " \u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"


def rom(code):
    """Return the ROM's character for a code from 0x10 on, or '?' if Unicode has no similar character."""
    if code in _ROM_A00:
        return _ROM_A00[code]
    if 0x20 <= code < 0x7E:
        return chr(code)
    return " " if code < 0x20 or 0x80 <= code <= 0xA0 else "?"


def drawn(rows):
    """Return the character that looks most like a 5x8 pattern, or '?'.

    rows: eight values. Bit 4 is the left dot, and bit 0 the right dot.
    """
    rows = [row & 0x1F for row in rows]
    inked = [row for row in rows if row]
    if not inked:
        return " "
    if all(row == 0x1F for row in rows[8 - len(inked) :]):
        return _FROM_BELOW[len(inked)]
    row = inked[0]
    if len(inked) < 5 or any(r != row for r in inked):
        return "?"
    # Vertical bars, perhaps with an empty row above or below
    for columns in range(1, 6):
        if row == 0x1F & ~(0x1F >> columns):
            return _FROM_LEFT[columns]
        if row == (1 << columns) - 1:
            return _FROM_RIGHT[columns]
    return "|" if row in (0x04, 0x08, 0x02) else "?"


_RS, _RW, _E, _LIGHT = 0x01, 0x02, 0x04, 0x08

POWER_UP_US = 40_000  # busy time after power-up at 3.3 V; at 5 V it is 15 ms
WAKE_US = (4100, 100)  # busy time after the first and second "function set, 8 bit" since power-up (figures 23, 24)
CLEAR_US = 1520  # busy time of "clear display" and "return home"
COMMAND_US = 37
DATA_US = 41  # busy time of a character: 37 us, plus 4 us for the address counter

# Wirings of other backpacks: (pins of RS, R/W, E and backlight, level that switches the backlight on, pin of D4)
WIRINGS = {2: (6, 5, 4, 7, 0, 0), 3: (4, 5, 6, 7, 1, 0), 4: (0, 1, 2, 3, 0, 4)}

COLUMNS = 16
_LINE = 40  # number of characters of a line in display memory. Only 16 of them are visible
# (address past the end of a line, address where the counter continues)
_TWO_LINE_WRAPS = ((0x28, 0x40), (0x68, 0x00), (0x3F, 0x27), (-1, 0x67))
_ONE_LINE_WRAPS = ((0x50, 0x00), (-1, 0x4F))

_LEAN_PAGE = re.compile("Lean +([0-9]+)° (left|right)?[ *]*$")


def shown_lean(lines):
    """Return the lean that the two lines show, in degrees, positive to the right, or None on another page."""
    match = _LEAN_PAGE.match(lines[0])
    return match and float(match.group(1)) * (-1.0 if match.group(2) == "left" else 1.0)


class Lcd:
    """A display.

    address: 0x20..0x27 (PCF8574) or 0x38..0x3F (PCF8574A).
    wiring: wiring of the backpack, 1 for the usual one, otherwise a key of WIRINGS.
    changes: number of visible changes.
    lost: number of nibbles (bytes in 8-bit mode) that were sent while the display was busy.
    """

    max_hz = 100_000  # the PCF8574 is a standard-mode part

    def __init__(self, clock, address=0x27):
        self.address = address
        self.clock = clock
        self.wiring = 1
        self._raw = 0xFF  # levels of P0..P7; they differ from _port if the wiring is not the usual one
        self.changes = 0
        self.power_on()

    def power_on(self):
        """Set the state after the internal reset: off, one line, 8-bit mode, and busy for POWER_UP_US."""
        self.ddram = bytearray(b" " * 128)  # display memory, with the lines at 0x00..0x27 and 0x40..0x67
        self.cgram = bytearray(64)
        self.glyphs = [" "] * 8  # the patterns in cgram as text
        self.lost = 0
        self.on = self.cursor = self.blink = False
        self.two_lines = False
        self._port = self._raw = 0xFF  # the outputs of a PCF8574 are high after power-on
        self._rs = 0  # level of RS when E last rose
        self._eight_bit = True
        self._high = -1  # the first nibble of a byte until the second arrives, otherwise -1
        self._low_next = False  # True if the next read returns the low nibble
        self._in_cgram = False
        self._ac = 0  # address counter
        self._step = 1
        self._shifts = False
        self._shift = 0
        self._wakes = 0
        self._busy_us = self.clock.now_us + POWER_UP_US
        self.changes += 1

    def power_off(self):
        self.on = False
        self._port = 0
        self.changes += 1

    def slip(self):
        """Shift the pairing of nibbles to bytes by one nibble, as a spike on E does."""
        if not self._eight_bit:
            self._high = 0 if self._high < 0 else -1

    @property
    def backlight(self):
        return bool(self._port & _LIGHT)

    def codes(self):
        """Return two lists of the 16 visible character codes."""
        places = [(self._shift + i) % _LINE for i in range(COLUMNS)]
        return [[self.ddram[start + column] for column in places] for start in (0x00, 0x40)]

    def text(self):
        """Return two strings of the 16 visible characters, blank while the display is off."""
        glyphs = self.glyphs
        lines = ["".join([glyphs[code & 7] if code < 0x10 else rom(code) for code in line]) for line in self.codes()]
        if not self.on:
            lines = [" " * COLUMNS, " " * COLUMNS]
        elif not self.two_lines:
            lines[1] = " " * COLUMNS
        return lines

    # The I2C side

    def start(self, address, read):
        return True

    def write_byte(self, value):
        """Set the levels of the eight pins. When E falls, the display reads the levels before the change."""
        if self.wiring != 1:
            self._raw, value = value, self._as_usual(value)
        previous = self._port
        self._port = value
        if (previous ^ value) & _LIGHT:
            self.changes += 1
        if value & _E and not previous & _E:
            self._rs = previous & _RS  # RS must be stable 40 ns before E rises (tAS), so a change with E comes too late
        elif previous & _E and not value & _E:
            self._latch(previous & ~_RS | self._rs)
        return True

    def read_byte(self):
        """Read the eight pins. While R/W and E are high, D7..D4 carry the busy flag and the address counter. The high
        nibble comes first."""
        port = self._port
        if self.wiring != 1:
            return self._raw
        if not (port & _RW and port & _E) or port & _RS:
            return port
        status = self._ac | (0x80 if self.clock.now_us < self._busy_us else 0)
        if self._low_next and not self._eight_bit:
            status <<= 4
        return (port & 0x0F) | (status & 0xF0)

    def _as_usual(self, value):
        rs, rw, enable, light, level, data = WIRINGS[self.wiring]
        bits = (value >> rs & 1) * _RS | (value >> rw & 1) * _RW | (value >> enable & 1) * _E
        return bits | (_LIGHT if value >> light & 1 == level else 0) | (value >> data & 15) << 4

    # The controller

    def _latch(self, port):
        if port & _RW:
            self._low_next = not self._low_next and not self._eight_bit
            return
        if self.clock.now_us < self._busy_us:
            self.lost += 1
            return
        nibble = port >> 4
        if self._eight_bit:
            self._receive(nibble << 4 | 0x0F, port & _RS)
        elif self._high < 0:
            self._high = nibble
        else:
            value = self._high << 4 | nibble
            self._high = -1
            self._receive(value, port & _RS)

    def _receive(self, value, is_data):
        """Execute a byte from the bus, and be busy for its duration."""
        if is_data:
            self._store(value)
            busy_us = DATA_US
        else:
            busy_us = self._command(value)
        self._busy_us = self.clock.now_us + busy_us

    def _store(self, value):
        """Store a byte in the character memory or in the display memory, and move the cursor."""
        if self._in_cgram:
            if self.cgram[self._ac] != value:
                self.cgram[self._ac] = value
                glyph = self._ac >> 3
                self.glyphs[glyph] = drawn(self.cgram[glyph * 8 : glyph * 8 + 8])
                self.changes += 1
            self._ac = (self._ac + self._step) & 0x3F
            return
        if self.ddram[self._ac] != value:
            self.ddram[self._ac] = value
            self.changes += 1
        self._move(self._step)
        if self._shifts:
            self._shift_by(self._step)

    def _move(self, step):
        ac = self._ac + step
        wraps = _TWO_LINE_WRAPS if self.two_lines else _ONE_LINE_WRAPS
        for beyond, wrapped in wraps:
            if ac == beyond:
                ac = wrapped
        self._ac = ac & 0x7F

    def _shift_by(self, step):
        self._shift = (self._shift + step) % _LINE
        self.changes += 1

    def _command(self, value):
        """Execute a command. Returns its duration in us."""
        if value & 0x80:  # an address in DDRAM
            self._ac = value & 0x7F
            self._in_cgram = False
        elif value & 0x40:  # an address in CGRAM
            self._ac = value & 0x3F
            self._in_cgram = True
        elif value & 0x20:
            return self._function_set(value)
        elif value & 0x10:  # a shift of text or cursor
            step = 1 if value & 0x04 else -1
            if value & 0x08:
                self._shift_by(-step)  # the text moves right when the window moves left
            else:
                self._move(step)
        elif value & 0x08:
            self.on, self.cursor, self.blink = bool(value & 4), bool(value & 2), bool(value & 1)
            self.changes += 1
        elif value & 0x04:  # the entry mode
            self._step = 1 if value & 2 else -1
            self._shifts = bool(value & 1)
        elif value:  # home, or clear
            if value & 0x02 == 0:
                self.ddram = bytearray(b" " * 128)
                self._step = 1
            self._ac = 0
            self._in_cgram = False
            self._shift = 0
            self.changes += 1
            return CLEAR_US
        return COMMAND_US

    def _function_set(self, value):
        self._eight_bit = bool(value & 0x10)
        self.two_lines = bool(value & 0x08)
        self.changes += 1
        if self._eight_bit and self._wakes < len(WAKE_US):
            self._wakes += 1
            return WAKE_US[self._wakes - 1]
        return COMMAND_US
