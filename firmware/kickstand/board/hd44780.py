"""Driver for an HD44780 character display, 16x2 or larger, behind a PCF8574 port expander (the usual I2C backpack).
display.py finds it and describes its methods. other_lcds.py has the drivers of other character displays.

Sources: data sheets Hitachi HD44780U (ADE-207-272) and NXP PCF8574. The driver uses the 4-bit mode. The driver sends
the changed part of a line in two transfers: first dashes, then the text. A transfer of a whole line takes 6 ms at 100
kHz.

Different backpacks connect the pins of the PCF8574 in different ways, see WIRINGS. The bit of R/W is between the bits
of RS and E, and stays low.
"""

from time import ticks_diff, ticks_ms

from micropython import const

# Index: LCD_WIRING - 1. Each row has the bits of RS, E and the backlight, then 4 minus the pin of D4
WIRINGS = (
    (0x01, 0x04, 0x08, 0),  # the usual wiring: RS at P0, E at P2, backlight at P3
    (0x40, 0x10, 0x00, 4),  # MJKDZ, GY-IICLCD: RS at P6, E at P4, backlight at P7, on while P7 is low
    (0x10, 0x40, 0x80, 4),  # RS at P4, E at P6, backlight at P7
    (0x01, 0x04, 0x00, 0),  # like the first wiring, but the backlight is on while P3 is low
)
_LINE_ADDRESSES = (0x80, 0xC0)  # instruction "set DDRAM address" for the beginning of each line (table 6)
_CGRAM_ADDRESS = const(0x40)  # instruction "set CGRAM address" (table 6)

_COLUMNS = const(16)
_DASHES = b"-" * _COLUMNS
_NO_TEXT = "\n"
_NEVER = b"\xfe" * _COLUMNS  # marks a line that was not written yet; no text uses this code
# Time between two initialisations. After electrical noise the display may combine the wrong nibbles into bytes. Only an
# initialisation repairs such a display.
_REINIT_MS = const(10_000)
_PROBE_MS = const(200)  # time between two checks that the display is connected
_STEP_MS = const(5)  # time between two steps of the initialisation, which requires waits of up to 4.1 ms
_POWER_UP = const(-8)  # number of the first step after power-up, because the display takes no instruction for 40 ms

# Initialisation by instruction (data sheet, figure 24). Each tick does one step, and steps are _STEP_MS apart, so the
# loop never waits. First come single nibbles, which bring the display into 4-bit mode from any state. Then come whole
# bytes: function set (4 bit, 2 lines); display on, no cursor; entry mode left to right; return home, which undoes a
# shift. Each of the first three bytes needs 37 us, which is less than a transfer takes.
_NIBBLES = (0x30, 0x30, 0x30, 0x20)
_COMMANDS = b"\x28\x0c\x06\x02"
_GLYPH_PARTS = const(4)  # the 64 bytes of character patterns are sent 16 at a time
# Number of characters to blank behind each line, one line per step. Without the blanks, a larger display (20x4 or 20x2)
# would show characters from other memory.
_BEHIND = const(24)
_STEPS = len(_NIBBLES) + 1 + _GLYPH_PARTS + 2


def _bar_glyphs():
    """Return the patterns of characters 0 to 7 (64 bytes): 1 to 4 of 5 columns filled from the left, then from the
    right."""
    rows = bytearray()
    for columns in range(1, 5):
        rows.extend(bytes([0x1F & ~(0x1F >> columns)] * 8))
    for columns in range(1, 5):
        rows.extend(bytes([(1 << columns) - 1] * 8))
    return rows


class Lcd:
    """The driver of the character display. display.py describes its methods."""

    draws = False

    def __init__(self, wiring=1):
        """wiring: number of the wiring in WIRINGS, from 1, like the setting LCD_WIRING."""
        self._rs, self._e, self._light, self._shift = WIRINGS[wiring - 1]
        self._wanted = [bytearray(b" " * _COLUMNS), bytearray(b" " * _COLUMNS)]
        self._shown = [bytearray(_COLUMNS), bytearray(_COLUMNS)]
        self._texts = [_NO_TEXT, _NO_TEXT]  # the last text of each line, if it was a str
        self._changed = True  # True if a line may still have to be sent
        self._packed = bytearray(4 * (_BEHIND + 1) + 2)
        self._port = bytearray(1)
        self._glyphs = _bar_glyphs()

    def begin(self, i2c, address, hz, fresh):
        self._i2c = i2c
        self._address = address
        # Number of the next step of the initialisation, negative while the display powers up
        self._step = _POWER_UP if fresh else 0
        self._acted_ms = ticks_ms()  # time of the last transfer
        self._seen_ms = 0  # time of the display's last answer
        self._init_ms = 0  # time of the end of the last initialisation

    @property
    def busy(self):
        return self._changed or self._step < _STEPS

    def show(self, line1, line2, picture=None):
        """Set the two lines that tick() sends.

        A line is str or bytes, and is padded or cut to 16 characters. Codes 0 to 7 show the patterns of _bar_glyphs().
        Other codes show the characters of the display's ROM. picture: not used."""
        self._put(0, line1)
        self._put(1, line2)

    def tick(self, now_ms):
        """Send at most one line, or do one step of the initialisation."""
        if ticks_diff(now_ms, self._acted_ms) < _STEP_MS:
            return
        if self._step < _STEPS:
            self._acted_ms = now_ms
            if self._step > 0 and not self._kept_power():
                self._step = _POWER_UP
            if self._step >= 0:
                self._initialise(self._step)
            self._step += 1
            self._init_ms = self._seen_ms = now_ms
        # New text is sent before the checks, because the shown text may be too old
        elif self._changed and self._refresh():
            self._seen_ms = self._acted_ms = now_ms
        elif ticks_diff(now_ms, self._seen_ms) >= _PROBE_MS:
            self._seen_ms = self._acted_ms = now_ms
            if not self._kept_power():
                self._step = _POWER_UP
        elif ticks_diff(now_ms, self._init_ms) >= _REINIT_MS:
            self._step = 0

    def _put(self, number, text):
        if isinstance(text, str):
            if text == self._texts[number]:  # the text is usually the same, and skipping its conversion saves 0.2 ms
                return
            self._texts[number] = text
            text = bytes([ord(letter) & 0xFF for letter in text])
        else:
            self._texts[number] = _NO_TEXT
        line, n = self._wanted[number], min(_COLUMNS, len(text))
        line[:n] = text[:n]
        line[n:] = b" " * (_COLUMNS - n)
        self._changed = True

    def _initialise(self, step):
        if step < len(_NIBBLES):
            nibble = _NIBBLES[step] >> self._shift | self._light
            self._i2c.writeto(self._address, bytes((nibble, nibble | self._e, nibble)))
        elif step == len(_NIBBLES):
            for command in _COMMANDS:
                self._send(command, b"")
        elif step >= _STEPS - 2:
            self._send(_LINE_ADDRESSES[step - _STEPS] + _COLUMNS, b" " * _BEHIND)
        else:
            quarter = (step - len(_NIBBLES) - 1) * _COLUMNS
            self._send(_CGRAM_ADDRESS + quarter, memoryview(self._glyphs)[quarter : quarter + _COLUMNS])
            for line in self._shown:  # write both lines again
                line[:] = _NEVER
            self._changed = True

    def _kept_power(self):
        """Return False if the display has lost its power since the last transfer, even for a moment.

        The PCF8574's pins are high after power-up, but every transfer leaves E low. So call this method before the next
        transfer. Raises OSError if the display does not answer."""
        self._i2c.readfrom_into(self._address, self._port)
        return not self._port[0] & self._e

    def _refresh(self):
        """Send the changed part of one line. Return False if no line has changed."""
        for i in (0, 1):
            target, sent = self._wanted[i], self._shown[i]
            if sent != target:
                if not self._kept_power():
                    self._step = _POWER_UP
                    return True
                first, last = 0, _COLUMNS - 1
                while sent[first] == target[first]:
                    first += 1
                while sent[last] == target[last]:
                    last -= 1
                address = _LINE_ADDRESSES[i] + first
                # Send dashes first, because an interrupted transfer must not leave half a number or the wrong word for
                # the side
                if last > first:
                    self._send(address, memoryview(_DASHES)[first : last + 1])
                self._send(address, memoryview(target)[first : last + 1])
                sent[:] = target
                return True
        self._changed = False
        return False

    def _send(self, command, data):
        """Send an instruction and the data that follow it in one transfer.

        RS must be stable for 40 ns before E rises (tAS, p. 49), so a byte that only changes RS comes first."""
        packed, light = self._packed, self._light
        packed[0] = light
        self._pack(1, command, light)
        packed[5] = light | self._rs
        for i in range(len(data)):
            self._pack(4 * i + 6, data[i], light | self._rs)
        self._i2c.writeto(self._address, memoryview(packed)[: 4 * len(data) + 6])

    def _pack(self, at, value, control):
        """Put a byte into _packed as two nibbles. Each nibble is sent with E high, then with E low, because the falling
        edge of E latches it."""
        packed, enable = self._packed, self._e
        high = (value & 0xF0) >> self._shift | control
        low = (value << 4 & 0xF0) >> self._shift | control
        packed[at] = high | enable
        packed[at + 1] = high
        packed[at + 2] = low | enable
        packed[at + 3] = low
