"""A page of your own: the load on the tyres in a bend, as text and, on an OLED, as a bar.

Copy it to the board as user.py, and restart (the firmware must be on the board; an update leaves user.py alone):

    mpremote cp firmware/examples/user_page.py :user.py
    mpremote reset

Press the button until the page appears. The page follows the last of the usual pages. Before the bike is aligned,
choose Own pages in the menu. Without a board: kickstand try firmware/examples/user_page.py
"""

from math import cos, radians


def page(app):
    """Return two lines of at most 16 characters, and a picture for a display that draws."""
    if not app.trusted:  # there is no reliable lean
        return "Load     --", "not sure yet"
    meter = app.meter
    times = 1.0 / cos(radians(meter.lean_deg))  # force on the tyres in a balanced bend, as a multiple of the weight
    line1, line2 = "Load    %5.2f x" % times, "Lean %3d deg" % round(abs(meter.lean_deg))
    return line1, line2, (draw, line1, line2, min(128, round(64 * times)))


def draw(canvas, line1, line2, length):
    """Draw the picture.

    canvas is a framebuf.FrameBuffer of 128x64 pixels. The canvas also has tall(line, page) for letters of 8x16
    pixels."""
    canvas.tall(line1, 1)
    canvas.text(line2, 0, 32, 1)
    canvas.fill_rect(0, 48, length, 12, 1)
    canvas.rect(0, 48, 128, 12, 1)
