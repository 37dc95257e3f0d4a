"""Models two OLED controllers on I2C with a panel of 128x64 pixels: Solomon Systech SSD1306 (data sheet rev 1.1) and
Sino Wealth SH1106 (V2.3).

A transfer begins with control bytes. Co (bit 7) is 1 if only one byte follows, 0 if the rest is a stream. D/C (bit 6)
is 1 for data. The SSD1306 has 128 columns and three addressing modes. The SH1106 has only page addressing and 132
columns, of which the panel shows columns 2 to 129.
"""

from .fakes.framebuf_font import FONT

WIDTH, HEIGHT = 128, 64
PAGES = HEIGHT // 8
# {kind: (columns of RAM, first visible column, low half of the status)}. The status was measured on chips, because no
# data sheet has it.
_KINDS = {"ssd1306": (128, 0, 0x03), "sh1106": (132, 2, 0x08)}
# {kind: commands that the driver sends for the other kind of chip, and that this kind ignores}
_IGNORED = {"ssd1306": (0xAD, 0x8B), "sh1106": (0x8D, 0x20, 0x2E)}
# {command: number of its arguments}
_ARGUMENTS = {0x81: 1, 0xA8: 1, 0xD3: 1, 0xD5: 1, 0xD9: 1, 0xDA: 1, 0xDB: 1}
_OWN_ARGUMENTS = {
    "ssd1306": {0x20: 1, 0x21: 2, 0x22: 2, 0x8D: 1, 0x26: 6, 0x27: 6, 0x29: 5, 0x2A: 5, 0xA3: 2},
    "sh1106": {0xAD: 1},
}
_SWITCHES = {0xA0: "_flipped_columns", 0xA4: "_all_on", 0xA6: "inverted", 0xAE: "on"}  # bit 0 means on
_OFF = 0x40  # bit of the status while the display is off


class Oled:
    """A display.

    kind: "ssd1306" or "sh1106".
    identity: low half of the status.
    alternate: True if rows alternate, as on a panel of 64 rows. On a panel of 32 rows, the rows are in sequence.
    on: True if switched on.
    pumped: True if the pixels have their voltage.
    inverted, contrast, start_line: settings.
    changes: number of visible changes.
    unknown: number of received commands that the controller does not have.
    """

    max_hz = 400_000

    def __init__(self, clock, address=0x3C, kind="ssd1306"):
        self.address = address
        self.clock = clock
        self.kind = kind
        self._columns, self._first, self.identity = _KINDS[kind]
        self._arguments = dict(_ARGUMENTS)
        self._arguments.update(_OWN_ARGUMENTS[kind])
        self.changes = 0
        self._power = 0
        self._read, self._lines = -1, []  # number of changes when the text was read, and the text
        self.power_on()

    def power_on(self):
        """Set the state after a reset. The display is off, and its RAM has arbitrary content."""
        self._power += 1
        self.ram = bytearray([(37 * i + 91 * self._power) & 0xFF for i in range(self._columns * PAGES)])
        self.on = self.pumped = self.inverted = self._all_on = False
        self.contrast = 0x7F if self.kind == "ssd1306" else 0x80
        self.start_line = self._offset = 0
        self._mux, self.alternate = 63, True
        self._flipped_columns = self._flipped_rows = False
        self._mode = 2  # addressing mode: page by page
        self._page = self._column = 0
        self._window = [0, self._columns - 1, 0, PAGES - 1]
        self._control = True  # the next byte is a control byte
        self._is_single = self._data = False
        self._command = []  # the command with its arguments so far
        self.unknown = 0
        self.changes += 1

    def power_off(self):
        self.on = False
        self.changes += 1

    @property
    def backlight(self):
        return self.on and self.pumped

    def pixels(self):
        """Return the visible pixels, row by row from the top. A byte has 8 pixels, the leftmost in bit 7.

        Columns and rows are both reversed, because modules are mounted with the cable's edge at the top.
        """
        rows = bytearray(WIDTH // 8 * HEIGHT)
        if not self.backlight:
            return rows
        for y in range(HEIGHT):
            at = y if self._flipped_rows else HEIGHT - 1 - y
            row = (at + self.start_line + self._offset) % HEIGHT
            for x in range(WIDTH):
                column = self._first + (x if self._flipped_columns else WIDTH - 1 - x)
                lit = self._all_on or self.ram[(row >> 3) * self._columns + column] >> (row & 7) & 1
                if bool(lit) != self.inverted and y <= self._mux:
                    rows[(y * WIDTH + x) >> 3] |= 0x80 >> (x & 7)
        return rows

    @property
    def rows(self):
        return self._mux + 1

    def pages(self):
        starts = [page * self._columns + self._first for page in range(PAGES)]
        return [self.ram[start : start + WIDTH] for start in starts]

    def text(self):
        """Return the two lines that a character display would show (see lines())."""
        if self._read != self.changes:
            self._read = self.changes
            self._lines = lines(self)
        return list(self._lines)

    # The I2C side

    def start(self, address, read):
        self._control = True
        return True

    def write_byte(self, value):
        """Receive a control byte, a command or its argument, or eight pixels."""
        if self._control:  # Co: one byte follows, then a control byte again. D/C: pixels follow, not commands
            self._is_single, self._data = bool(value & 0x80), bool(value & 0x40)
            self._control = False
            return True
        if self._data:
            self._store(value)
        else:
            self._receive(value)
        self._control = self._is_single
        return True

    def read_byte(self):
        return self.identity | (0 if self.on else _OFF)

    # The controller

    def _store(self, value):
        index = self._page * self._columns + self._column
        if self.ram[index] != value:
            self.ram[index] = value
            self.changes += 1
        first, last, top, bottom = self._window
        if self._mode == 2:  # the address stays within the page; an SH1106 stops at its last column
            if self._column < self._columns - 1:
                self._column += 1
            elif self.kind == "ssd1306":
                self._column = 0
        elif self._mode == 0:
            self._column = first if self._column == last else self._column + 1
            if self._column == first:
                self._page = top if self._page == bottom else self._page + 1
        else:
            self._page = top if self._page == bottom else self._page + 1
            if self._page == top:
                self._column = first if self._column == last else self._column + 1

    def _receive(self, value):
        self._command.append(value)
        if len(self._command) > self._arguments.get(self._command[0], 0):
            self._execute(self._command)
            self._command = []
            self.changes += 1

    def _execute(self, command):
        """Do a command. command: its code and its arguments."""
        code, argument = command[0], command[-1]
        if code < 0x20:
            if self._mode == 2:
                low, high = self._column & 0x0F, self._column & 0xF0
                self._column = (high | code if code < 0x10 else (code & 0x0F) << 4 | low) % self._columns
        elif 0x40 <= code < 0x80:
            self.start_line = code & 0x3F
        elif 0xB0 <= code < 0xB8:
            self._page = code & 7
        elif code & 0xFE in _SWITCHES:
            setattr(self, _SWITCHES[code & 0xFE], bool(code & 1))
        elif code in (0xC0, 0xC8):
            self._flipped_rows = code == 0xC8
        elif code == 0x81:
            self.contrast = argument
        elif code == 0xA8:
            self._mux = argument & 0x3F
        elif code == 0xD3:
            self._offset = argument & 0x3F
        elif code == 0xDA:
            self.alternate = bool(argument & 0x10)
        elif code in (0xD5, 0xD9, 0xDB, 0xE3) or code in _IGNORED[self.kind]:
            pass
        elif not (self._of_ssd1306(command) if self.kind == "ssd1306" else self._of_sh1106(command)):
            self.unknown += 1

    def _of_ssd1306(self, command):
        code = command[0]
        if code == 0x8D:  # the charge pump starts when the display is next switched on
            self.pumped = bool(command[1] & 0x04)
        elif code == 0x20:
            self._mode = command[1] & 3
        elif code == 0x21:
            self._column = self._window[0] = command[1] & 0x7F
            self._window[1] = command[2] & 0x7F
        elif code == 0x22:
            self._page = self._window[2] = command[1] & 7
            self._window[3] = command[2] & 7
        else:
            return code in (0x26, 0x27, 0x29, 0x2A, 0x2E, 0x2F, 0xA3)
        return True

    def _of_sh1106(self, command):
        if command[0] == 0xAD:  # the DC-DC converter
            self.pumped = bool(command[1] & 1)
            return True
        return 0x30 <= command[0] < 0x34 or command[0] in (0xE0, 0xEE)


_BLANK = " " * 16
_DIGIT_ROWS = 5  # height of a large digit, in pages
_DIGIT_COLUMNS = 24
_SPREAD = [sum([3 << 2 * bit for bit in range(4) if nibble >> bit & 1]) for nibble in range(16)]
_LETTERS = {bytes(FONT[8 * i : 8 * i + 8]): chr(32 + i) for i in range(95)}
# The driver draws these three characters itself, because they are not ASCII
_LETTERS[bytes((0, 15, 9, 9, 15, 0, 0, 0))] = "\u00b0"
_LETTERS[bytes((0, 0, 127, 62, 28, 8, 0, 0))] = "\u2192"
_LETTERS[b"\xff" * 8] = "\u2588"
for _columns in range(1, 5):
    _LETTERS[b"\xff" * (2 * _columns) + bytes(8 - 2 * _columns)] = "\u258e\u258d\u258b\u258a"[_columns - 1]
    _LETTERS[bytes(8 - 2 * _columns) + b"\xff" * (2 * _columns)] = "\u2595\u2590\u2590\u2590"[_columns - 1]
# The same letters at twice the height. The upper and the lower half of each column follow each other.
_TALL = {
    bytes([half for column in shape for half in (_SPREAD[column & 15], _SPREAD[column >> 4])]): letter
    for shape, letter in _LETTERS.items()
}


def lines(oled):
    """Return an Oled's page as two strings of 16 characters, blank if it is dark.

    The strings contain "?" if the display does not show a page of the firmware.
    """
    if not oled.backlight:
        return [_BLANK, _BLANK]
    pages = oled.pages()
    if oled.rows == 32:
        return [_tall(pages, 0) or "?", _tall(pages, 2) or "?"]
    first, second = _tall(pages, 1), _tall(pages, 5)
    if first is not None and second is not None:
        return [first, second]
    read = _picture(pages, _small(pages, 7) or "?")
    return [_padded(line, 16) for line in read or ("?", "?")]


def _padded(line, length):
    # %-16s would be wrong, because MicroPython counts the two bytes of a degree sign
    return line + " " * (length - len(line))


def _cells(line):
    return [bytes(line[8 * i : 8 * i + 8]) for i in range(16)]


def _small(pages, page):
    letters = [_LETTERS.get(cell, "") for cell in _cells(pages[page])]
    return "".join(letters) if all(letters) else None


def _tall(pages, page, inverted=0):
    """Return the letters of 8x16 pixels in this page and the next, or None."""
    letters = []
    for i in range(16):
        halves = [pages[page + k][8 * i + x] ^ inverted for x in range(8) for k in (0, 1)]
        letters.append(_TALL.get(bytes(halves), ""))
    return "".join(letters) if all(letters) else None


def _digit(pages, page, x):
    from kickstand.ui.glance import DIGITS

    pattern = b"".join([bytes(pages[page + row][x : x + _DIGIT_COLUMNS]) for row in range(_DIGIT_ROWS)])
    for digit in range(10):
        if pattern == DIGITS[len(pattern) * digit : len(pattern) * (digit + 1)]:
            return digit
    return None


def _number(pages, page, *columns):
    """Return the number whose digits are at these columns. Leading digits may be missing."""
    digits = [_digit(pages, page, x) for x in columns]
    while len(digits) > 1 and digits[0] is None:
        digits.pop(0)
    return None if None in digits else sum([10**i * digit for i, digit in enumerate(reversed(digits))])


def _picture(pages, below):
    """Return the two lines for a picture, or None. below: the line of text below the picture.

    The pages and columns of the digits are those of kickstand.ui.glance.
    """
    reason = _tall(pages, 5, 0xFF)
    if reason is not None:
        return "Lean  --", reason.strip()
    if below.startswith("pk"):
        integer, hundredths = _digit(pages, 1, 0), _number(pages, 1, 34, 62)
        word = "".join([_LETTERS.get(cell, "?") for cell in _cells(pages[1])[11:]])
        if integer is None or hundredths is None:
            return None
        return "%s   %5.2f g" % (word[0].upper() + word[1:], integer + hundredths / 100), below
    if "max" in below:
        left = _number(pages, 1, 2, 30)
        right = _number(pages, 1, 74, 102) if _digit(pages, 1, 102) is not None else _digit(pages, 1, 74)
        if left is None or right is None:
            return None
        return "Max left   %3d\u00b0" % left, "Max right  %3d\u00b0" % right
    number = _digit(pages, 2, 52)
    if number is None:
        number = _number(pages, 2, 38, 66)
    if number is None:
        return None
    words = below.replace("REC", "   ").split()
    line = "Lean %3d\u00b0 %s" % (number, words[0] if words else "")
    return (_padded(line, 15) + "*" if "REC" in below else line), ""
