"""Converts the HD44780's characters to Unicode: the characters of ROM A00, and patterns in its character memory."""

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
