"""The pages as pictures of 128x64 pixels, for a display that draws. Large digits can be read at a glance.

screen.py looks up the picture of a page in PICTURES. board/display.py says what a picture is. Rows 0 and 1 stay
blank, because an OLED shifts its picture.
"""

from binascii import a2b_base64

import framebuf

DIGIT_WIDTH, DIGIT_HEIGHT = 24, 40
_PITCH = 28  # number of columns from one digit to the next
_ARC_RADIUS, _ARC_DEG, _ARC_WIDTH = 100, 60, 7  # the arc has one column per degree of lean
_G_PIXELS = 60  # length of the bar for 1 g
_SMALL_Y = 56  # top row of the last line, which has letters of 8x8 pixels

# The ten digits. Each digit has 5 bands of 24 bytes. A byte has 8 rows of one column, with the top row in bit 0.
DIGITS = a2b_base64(
    b"AADA4PD4/Pz+/n5+fn7+/vz8+PDgwAAAAP///////wMAAAAAAAAAAAP///////8AAP///////wAAAAAAAAAAAAD///////8AAP//////"
    b"/8AAAAAAAAAAAMD///////8AAAADBw8fPz9/f35+fn5/fz8/Hw8HAwAAAAAAAICAwODw+Pz8/v7+/PgAAAAAAAAAAAAEHx8/Hx8PB///"
    b"//////8AAAAAAAAAAAAAAAAAAAAAAP////////8AAAAAAAAAAAAAAAAAAAAAAP////////8AAAAAAAAAAAAAAAAAAAAAAB8/f39/Px8A"
    b"AAAAAAAAAADA4PD4/Pz+/n5+fn7+/vz8+PDgwAAAAB8/Pz8/HwMAAAAAAAAAAMP///////8AAAAAAAAAAAAAAMDg8Pj+//9/Px8HAwAA"
    b"AAAAAMDg8Pz+//9/Px8HAwEAAAAAAAAAADx+f39/f39/f35+fn5+fn5+fn5+fjwAAIDg8Pj8/Pz+fn5+fn7+/Pz8+PDggAAAAAMHDw8H"
    b"BwEAAAAAAICAwf///////wgAAAAAAAAAAAAEHj8/Pz9///////vxwAAAQPDw+PDwwIAAAAAAAAAAgMH//////38AAAEHDx8/Pz9/fn5+"
    b"fn5/Pz8/Hw8HAQAAAAAAAAAAAAAAgOD4/P7+/v7+/AAAAAAAAAAAAAAAwPD8/////////////wAAAAAAAADA8Pz/////Pw8BAP//////"
    b"/wAAAAAACB8/Pz8/Pz8/Pz8/P////////z8/Pz4eAAAAAAAAAAAAAAAAAD9/f39/PwAAAAAAAAD8/v7+/v5+fn5+fn5+fn5+fn5+PAAA"
    b"AOD////////AwODg4MDAwICAAAAAAAAAAAcfHz8/Pz8fDw8PDw8fP3////788MAAAODw+Pjw4IAAAAAAAAAAgOD//////z8AAAADBw8f"
    b"Pz9/fn5+fn5/Pz8fHw8DAQAAAAAAAIDg8Pj4/Pz8/P5+fn5+PhwAAAAAAADw/v/////fx8HAwMDAgIAAAAAAAAAAAP7//////38/Hw8P"
    b"Dw8fP3////788MAAAH///////8CAAAAAAAAAgMD//////38AAAABBw8fPz9/f35+fn5/fz8/Hw8HAQAAADx+fn5+fn5+fn5+fn5+fv7+"
    b"/v7+/nwAAAAAAAAAAAAAAAAAAIDw/v////8fAwAAAAAAAAAAAAAAAADA+P////9/DwAAAAAAAAAAAAAAAAAA8P7/////HwMAAAAAAAAA"
    b"AAAAAAAAADh/f39/Pw8AAAAAAAAAAAAAAACA4PD4/Pz+/n5+fn7+/vz8+PDggAAAAAD////////BgICAgICAwf///////wAAAIDg8f//"
    b"//9/Pz8/Pz8/f//////x4IAAAH///////8EAAAAAAAAAAMH//////38AAAADBw8fPz9/f35+fn5/fz8/Hw8HAwAAAACA4PD4/Pz+/n5+"
    b"fn7+/vz8+PDggAAAAP7//////wMBAAAAAAAAAQP///////4AAAMPP3////78+PDw8PD4/P7//////38AAAAAAAAAAAEBAwMDA4Pj+///"
    b"//9/DwAAAAAAADh8fn5+fn8/Pz8/Hx8PBwEAAAAA"
)
_GLYPHS = [
    framebuf.FrameBuffer(bytearray(DIGITS[at : at + 120]), DIGIT_WIDTH, DIGIT_HEIGHT, framebuf.MONO_VLSB)
    for at in range(0, 1200, 120)
]
# For each number of columns from the middle, the row of the arc's upper edge
_ARC = bytes(2 + _ARC_RADIUS - int((_ARC_RADIUS**2 - x * x) ** 0.5 + 0.5) for x in range(_ARC_DEG + 1))


def _scale():
    """Return the arc without a lean. The arc is drawn only once, because drawing takes 6 ms."""
    scale = framebuf.FrameBuffer(bytearray(128 * 4), 128, 32, framebuf.MONO_VLSB)
    for x in range(_ARC_DEG + 1):
        for column in (64 + x, 64 - x):
            scale.vline(column, _ARC[x], 1 if x % 30 else _ARC_WIDTH, 1)
    return scale


_SCALE = _scale()


def _number(canvas, value, x, y, digits=0):
    """Draw a number with at least `digits` digits. Return the column where the number ends."""
    for character in "%0*d" % (digits, value):
        canvas.blit(_GLYPHS[ord(character) - 48], x, y)
        x += _PITCH
    return x


def _triangle(canvas, x, y, direction):
    """Draw an arrow 24 columns wide, with its point at x, y.

    Args:
        direction: -1 to the left, 1 to the right.
    """
    for i in range(24):
        half = i * 14 // 23
        canvas.vline(x - direction * i, y - half, 2 * half + 1, 1)


def lean(meter, recording, line2=""):
    """Return the picture of the lean with its side, and of an arc that ends at 60 degrees."""
    deg = meter.lean_deg
    return _lean, int(deg + (0.5 if deg > 0 else -0.5)), recording


def _lean(canvas, deg, recording):
    number = abs(deg)
    canvas.blit(_SCALE, 0, 0)
    for x in range(min(_ARC_DEG, number) + 1):
        canvas.vline(64 + x if deg > 0 else 64 - x, _ARC[x], _ARC_WIDTH, 1)
    x = _number(canvas, number, 52 if number < 10 else 38, 16)
    for side_x in (0, 5):  # the left and the right side of the degree sign
        canvas.vline(x - 3 + side_x, 17, 4, 1)
        canvas.hline(x - 2, 16 + side_x, 4, 1)
    if deg < 0:
        _triangle(canvas, 2, 40, -1)
        canvas.text("left", 0, _SMALL_Y, 1)
    elif deg:
        _triangle(canvas, 125, 40, 1)
        canvas.text("right", 88, _SMALL_Y, 1)
    if recording:
        canvas.text("REC", 48, _SMALL_Y, 1)


def unsure(line1, line2):
    """Return the picture of dashes instead of a lean, with the reason as dark letters in a bright band."""
    return _unsure, line2


def _unsure(canvas, reason):
    for x in (38, 66):
        canvas.fill_rect(x, 18, DIGIT_WIDTH, 8, 1)
    canvas.tall(" " * ((17 - len(reason)) // 2) + reason, 5, True)
    for y in (39, 56):  # a bright row above and below the letters
        canvas.hline(0, y, 128, 1)


def maxima(meter, recording, line2=""):
    """Return the picture of the largest lean to each side."""
    return _maxima, int(meter.max_left_deg + 0.5), int(meter.max_right_deg + 0.5)


def _maxima(canvas, left, right):
    _number(canvas, left, 2 if left > 9 else 30, 8)
    _number(canvas, right, 74, 8)
    canvas.vline(63, 8, 40, 1)
    canvas.text("left  max  right", 0, _SMALL_Y, 1)


def acceleration(meter, recording, line2=""):
    """Return the picture of braking or acceleration as a number and a bar, with the peaks of both.

    line2: the second line of the page, which has the peaks."""
    forward, most, least = meter.smooth_force[2], meter.max_accel_g, meter.max_brake_g
    return _acceleration, round(100 * forward), round(_G_PIXELS * most), round(_G_PIXELS * least), line2


def _acceleration(canvas, hundredths, most, least, peaks):
    number = abs(hundredths)
    _number(canvas, number // 100 % 10, 0, 8)
    canvas.fill_rect(25, 42, 6, 6, 1)
    _number(canvas, number % 100, 34, 8, 2)
    canvas.text("brake" if hundredths < 0 else "accel", 88, 8, 1)
    canvas.text("g", 94, 40, 1)
    canvas.hline(0, 51, 128, 1)
    length = min(63, number * _G_PIXELS // 100)
    canvas.fill_rect(64 - length if hundredths < 0 else 64, 49, length, 6, 1)
    for x in (64, 64 + min(63, most), 64 - min(63, least)):
        canvas.vline(x, 49, 6, 1)
    canvas.text(peaks, 0, _SMALL_Y, 1)


# For the name of each page, the function that returns its picture from a LeanMeter, the state of recording, and the
# page's second line
PICTURES = {"lean": lean, "maxima": maxima, "acceleration": acceleration}
