"""Reads an OLED's pixels as the two lines that a character display would show.

So the same code can read every kind of display. Letters are recognised by their shapes. Pictures
(firmware/kickstand/ui/glance.py) are recognised by their digits and words.
"""

from .fakes.framebuf_font import FONT

_WIDTH = 128
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
    """Return two strings of 16 characters.

    The strings are blank if the display is dark. They contain "?" if the display does not show a page of the firmware.
    oled: an Oled.
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
    """Return the letters of 8x8 pixels in a page, or None."""
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
    """Return the large digit at column x whose top is in this page, or None."""
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
    """Return the two lines for a picture, or None. below: the line of text below the picture."""
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
