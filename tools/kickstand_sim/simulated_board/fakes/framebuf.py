"""MicroPython's module framebuf for CPython: the functions that the firmware and its examples use, pixel for pixel."""

from .framebuf_font import FONT

MONO_VLSB = 0
MONO_HLSB = 3


class FrameBuffer:
    """A picture of width x height pixels in a buffer.

    In MONO_VLSB a byte holds eight rows of a column, with the topmost row in bit 0. In MONO_HLSB a byte holds eight
    columns of a row, with the leftmost column in bit 7.
    """

    def __init__(self, buffer, width, height, format):
        self._buffer = buffer
        self._width, self._height = width, height
        self._horizontal = format == MONO_HLSB
        self._stride = (width + 7) // 8 * 8 if self._horizontal else width

    def _place(self, x, y):
        if self._horizontal:
            return (x + y * self._stride) >> 3, 0x80 >> (x & 7)
        return (y >> 3) * self._stride + x, 1 << (y & 7)

    def pixel(self, x, y, colour=None):
        """Set a pixel to a colour. Without a colour, return the pixel."""
        if not (0 <= x < self._width and 0 <= y < self._height):
            return None
        index, bit = self._place(x, y)
        if colour is None:
            return 1 if self._buffer[index] & bit else 0
        if colour:
            self._buffer[index] |= bit
        else:
            self._buffer[index] &= 0xFF ^ bit
        return None

    def fill(self, colour):
        self.fill_rect(0, 0, self._width, self._height, colour)

    def fill_rect(self, x, y, width, height, colour):
        for row in range(max(0, y), min(self._height, y + height)):
            for column in range(max(0, x), min(self._width, x + width)):
                self.pixel(column, row, colour)

    def hline(self, x, y, width, colour):
        self.fill_rect(x, y, width, 1, colour)

    def vline(self, x, y, height, colour):
        self.fill_rect(x, y, 1, height, colour)

    def rect(self, x, y, width, height, colour, filled=False):
        if filled:
            self.fill_rect(x, y, width, height, colour)
            return
        for row in (y, y + height - 1):
            self.hline(x, row, width, colour)
        for column in (x, x + width - 1):
            self.vline(column, y, height, colour)

    def line(self, x1, y1, x2, y2, colour):
        dx, dy = abs(x2 - x1), abs(y2 - y1)
        sx, sy = 1 if x2 > x1 else -1, 1 if y2 > y1 else -1
        steep = dy > dx
        if steep:
            x1, y1, dx, dy, sx, sy = y1, x1, dy, dx, sy, sx
        error = 2 * dy - dx
        for _ in range(dx):
            self.pixel(*((y1, x1) if steep else (x1, y1)), colour)
            while error >= 0:
                y1 += sy
                error -= 2 * dx
            x1 += sx
            error += 2 * dy
        self.pixel(x2, y2, colour)

    def text(self, text, x, y, colour=1):
        for character in text:
            code = ord(character)
            start = 8 * ((code if 32 <= code < 128 else 127) - 32)
            for i in range(8):
                for row in range(8):
                    if FONT[start + i] >> row & 1:
                        self.pixel(x + i, y + row, colour)
            x += 8

    def blit(self, source, x, y, key=-1):
        for row in range(source._height):
            for column in range(source._width):
                colour = source.pixel(column, row)
                if colour != key:
                    self.pixel(x + column, y + row, colour)
