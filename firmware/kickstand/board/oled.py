"""Driver for an OLED of 128x64 pixels with an SSD1306 or SH1106, or of 128x32 with an SSD1306. display.py finds it and
describes its methods.

Sources: data sheets Solomon Systech SSD1306 rev 1.1 and Sino Wealth SH1106 V2.3. The driver addresses both chips by
pages of 8 rows, because an SH1106 has no other way of addressing. An SH1106 has 132 columns, and the panel shows the
middle 128.
"""

from time import ticks_add, ticks_diff, ticks_ms

import framebuf

from ..units import const

WIDTH, HEIGHT = 128, 64
# A part is _PART columns of a page. Only changed parts are sent. Sending a part takes 0.9 ms at 400 kHz, and 3.5 ms at
# 100 kHz. One pass of the loop sends _PARTS parts, or _PARTS_SLOW parts on a bus slower than _SLOW_HZ.
_PART = 32
_PARTS, _PARTS_SLOW, _SLOW_HZ = 3, 2, 200_000
_PROBE_MS = const(200)  # time between two checks that the display has kept its power
_REFRESH_MS = const(10_000)  # time until the whole picture is sent again, to repair the effects of electrical noise
_POWER_UP_MS = 40
_OFF = 0x40  # bit of the status that is set while the panel is off
# Low half of the status of an SH1106. The low half of an SSD1306's status is 3 or 6, and a clone may have any value
_SH1106_STATUS = (0x08, 0x00, 0x0C)
_SH1106_OFFSET = 2  # first visible column of an SH1106
# Numbers of rows by which the picture is shifted to avoid burn-in, one after the other. Each shift lasts for
# _SHIFT_REFRESHES refreshes. Rows that leave the panel at the top return at the bottom, so pictures leave the first two
# rows blank.
_SHIFTS = (0, 1, 2, 1)
_SHIFT_REFRESHES = const(6)
# A panel of 32 rows has no blank rows at the top. So its picture is shifted down, over the two blank rows below the
# text.
_SHIFTS_32 = (0, 63, 62, 63)
# The first byte is a control byte, which starts a stream of commands. The commands are: clock; number of rows - 1; no
# offset; columns reversed; rows reversed; COM pins alternating (64 rows) or in sequence (32); pre-charge; VCOMH; show
# the RAM. Columns and rows are reversed because modules are mounted with the panel's flexible cable at the top.
_SET_UP = b"\x00\xd5\x80\xa8\x3f\xd3\x00\xa1\xc8\xda\x12\xd9\xf1\xdb\x40\xa4"
_SET_UP_32 = b"\x00\xd5\x80\xa8\x1f\xd3\x00\xa1\xc8\xda\x02\xd9\xf1\xdb\x40\xa4"
# Commands for the SH1106: DC-DC converter. Commands for the SSD1306: charge pump, page addressing, no scrolling.
# Without the commands for its own chip a panel stays dark. A clone may report the status of the other chip, so all
# commands are sent to every panel. Each chip ignores the other chip's commands.
_SUPPLY = b"\xad\x8b\x8d\x14\x20\x02\x2e"
# For each nibble, a byte with each bit of the nibble doubled
_SPREAD = bytes((i & 1) * 3 | (i & 2) * 6 | (i & 4) * 12 | (i & 8) * 24 for i in range(16))


class Canvas(framebuf.FrameBuffer):
    """The canvas of pictures: a FrameBuffer of 128x64 pixels that can write letters of twice the height."""

    def __init__(self, pixels):
        super().__init__(pixels, WIDTH, HEIGHT, framebuf.MONO_VLSB)
        self._pixels = pixels

    def tall(self, line, page, inverted=False):
        """Write up to 16 letters of 8x16 pixels across the display. The letters' top is at row 8 * page.

        line: str or bytes, as in show()."""
        for i in range(min(16, len(line))):
            character(self, line[i] if isinstance(line[i], int) else ord(line[i]), 8 * i, 8 * page)
        pixels = self._pixels
        invert = 0xFF if inverted else 0
        for index in range(page * WIDTH, (page + 1) * WIDTH):
            column = pixels[index]
            pixels[index] = _SPREAD[column & 15] ^ invert
            pixels[index + WIDTH] = _SPREAD[column >> 4] ^ invert


class Oled:
    """The driver of the OLED. display.py describes its methods.

    Args:
        kind: "ssd1306", "sh1106", "auto" or "ssd1306-32". The last kind is a panel of 32 rows, which shows only the two
            lines.
        contrast: 0 to 255.
        inverted: True for dark on bright.

    Attributes:
        canvas: the Canvas on which pictures are drawn.
    """

    def __init__(self, kind, contrast, inverted):
        self._kind = kind
        self.draws = kind != "ssd1306-32"
        self._look = bytes((0x81, contrast, 0xA7 if inverted else 0xA6))
        self._pixels = bytearray(WIDTH * HEIGHT // 8)
        self._sent = bytearray(WIDTH * HEIGHT // 8)
        self.canvas = Canvas(self._pixels)
        # The pixels to show and the pixels that were sent, part by part. Parts with the same columns are neighbours, so
        # the parts of a digit are sent together
        self._pages = HEIGHT // 8 if self.draws else HEIGHT // 16
        starts = [page * WIDTH + x for x in range(0, WIDTH, _PART) for page in range(self._pages)]
        self._new = [memoryview(self._pixels)[start : start + _PART] for start in starts]
        self._old = [memoryview(self._sent)[start : start + _PART] for start in starts]
        # A transfer consists of three commands, each after a control byte, and the data
        self._packet = bytearray(b"\x80\xb0\x80\x00\x80\x10\x40") + bytearray(_PART)
        self._status = bytearray(1)
        self._wanted = self._drawn = "", ""

    def begin(self, i2c, address, hz, fresh):
        self._i2c = i2c
        self._address = address
        self._most = _PARTS_SLOW if hz < _SLOW_HZ else _PARTS
        self._due_ms = ticks_add(ticks_ms(), _POWER_UP_MS if fresh else 0)
        self._refreshes = 0
        self._restart()

    def _restart(self):
        # Find the chip at every start, because another display may have been plugged in
        self._sh1106 = self._kind == "sh1106" or (self._kind == "auto" and self._state() & 0x0F in _SH1106_STATUS)
        self._set_up = self._lit = False
        self._send_all()

    def _send_all(self):
        self._unsent = len(self._new)  # number of parts that must be sent even if they are unchanged
        self._changed = True

    @property
    def busy(self):
        return not self._lit or self._changed or self._drawn is not self._wanted

    def show(self, line1, line2, picture=None):
        """Set what tick() shows: the picture or, without a picture, the two lines in letters of double height. The
        lines have the character codes of hd44780.py."""
        target = self.draws and picture
        if not target:
            target = tuple([line if isinstance(line, str) else bytes(line) for line in (line1, line2)])
        if target != self._wanted:
            self._wanted = target

    def tick(self, now_ms):
        """Do one step: draw, send some changed parts, or check the display's power.

        A picture does not change while it is being sent."""
        if ticks_diff(now_ms, self._due_ms) < 0:
            return
        if not self._set_up:  # the panel stays dark until the RAM is written
            self._command(b"\x00\xae")
            self._configure()
            self._draw(self._wanted)
            self._set_up = True
            self._seen_ms = self._refresh_ms = now_ms
        elif self._lit and ticks_diff(now_ms, self._seen_ms) >= _PROBE_MS:
            self._seen_ms = now_ms
            if self._state() & _OFF and self._reports_off:  # the panel is off, so the display has lost its power
                self._restart()
        elif self._changed:
            self._send()
        elif not self._lit:
            self._command(b"\x00\xaf")
            self._lit = True
            self._reports_off = not self._state() & _OFF  # False for clones that never report "off"
        elif ticks_diff(now_ms, self._refresh_ms) >= _REFRESH_MS:
            self._refresh_ms = now_ms
            self._refreshes += 1
            self._configure()
            self._lit = False
            self._send_all()
        elif self._drawn is not self._wanted:
            self._draw(self._wanted)

    def _state(self):
        self._i2c.readfrom_into(self._address, self._status)
        return self._status[0]

    def _command(self, commands):
        self._i2c.writeto(self._address, commands)

    def _configure(self):
        shifts = _SHIFTS if self.draws else _SHIFTS_32
        shift = shifts[self._refreshes // _SHIFT_REFRESHES % len(shifts)]
        self._command((_SET_UP if self.draws else _SET_UP_32) + _SUPPLY + self._look + bytes((0x40 | shift,)))

    def _send(self):
        """Send the first parts that have changed or must be sent anyway."""
        packet, remaining = self._packet, self._most
        for k in range(len(self._new)):
            new, old = self._new[k], self._old[k]
            if k >= len(self._new) - self._unsent or new != old:
                column = k // self._pages * _PART + (_SH1106_OFFSET if self._sh1106 else 0)
                packet[1] = 0xB0 | k % self._pages
                packet[3] = column & 0x0F
                packet[5] = 0x10 | column >> 4
                packet[7:] = new
                self._i2c.writeto(self._address, packet)
                old[:] = new
                self._unsent = min(self._unsent, len(self._new) - 1 - k)
                remaining -= 1
                if not remaining:
                    return
        self._changed = False

    def _draw(self, wanted):
        self._drawn = wanted
        self._changed = True
        self.canvas.fill(0)
        if callable(wanted[0]):
            wanted[0](self.canvas, *wanted[1:])
        else:
            self.canvas.tall(wanted[0], 1 if self.draws else 0)
            self.canvas.tall(wanted[1], 5 if self.draws else 2)


def character(canvas, code, x, y):
    """Draw a character of 8x8 pixels at x, y. code: a code of an HD44780's ROM, or of one of the patterns in
    hd44780.py."""
    if code < 8:
        columns = (code & 3) + 1
        canvas.fill_rect(x if code < 4 else x + 8 - 2 * columns, y, 2 * columns, 8, 1)
    elif code == 0xFF:
        canvas.fill_rect(x, y, 8, 8, 1)
    elif code == 0xDF:  # degree
        canvas.rect(x + 1, y, 4, 4, 1)
    elif code == 0x7E:  # arrow
        for i in range(4):
            canvas.vline(x + 2 + i, y + i, 7 - 2 * i, 1)
    else:
        canvas.text(chr(code), x, y, 1)
