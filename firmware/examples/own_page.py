"""Runs the lean meter with one more page: how heavy the bike is on its tyres in this turn.

The firmware must be on the board (`kickstand flash`), and the bike aligned with it once. Then, on your computer:

    mpremote run firmware/examples/own_page.py

Press the button until the new page comes, after the last of the usual ones:

    Load     1.31 x
    Lean  40° right

`mpremote reset` starts the lean meter without it. To keep the page, put the function into kickstand/ui/pages.py, add
`pages.load` to MOTORCYCLE in kickstand/ui/page_ring.py and a row to the table of pages in firmware/README.md, and
flash again.
"""

from math import cos, radians

from kickstand import settings
from kickstand.app import App
from kickstand.devices import open_lcd, open_sensor
from kickstand.ui import pages


def load(meter):
    """Two lines of at most 16 characters. meter: a LeanMeter, with lean_deg, force and more."""
    times = 1.0 / cos(radians(meter.lean_deg))  # weight and cornering force together, of a turn in balance
    lean_line, _ = pages.lean(meter)
    return "Load    %5.2f x" % times, lean_line


config = settings.load()
app = App(config, open_lcd(config), open_sensor(config))
app.screen.add_page(load)
app.run()
