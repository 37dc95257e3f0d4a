"""The menu, and the information about the sensor, which one of its entries opens.

Screen imports this module when the menu opens, and removes it when menu and information are closed, because it takes 3
KB of heap.
"""

import gc
from time import ticks_add, ticks_diff

from ..board.button import LONG
from ..board.display import DEGREE
from ..errors import Notice
from ..units import const
from .pages import recording, words

_ARROW = "\x7e"  # code of an arrow in the display's character ROM
_MENU_MS = const(20_000)  # time without a press after which the menu closes
_LEAVE = ("Leave menu", None, False)


def sensor_info(sensor, meter, seconds):
    """The page with information about the sensor. The page changes every two seconds.

    The first line has the chip's name and temperature. The second line shows these in turn:
    * which parts are calibrated
    * the number of overflows of the FIFO, and the number of set-ups and lost contacts of the chip
    * the number of lost samples
    * the chip's I2C address

    During a fault of the sensor the page shows the fault and the addresses that answer on its bus, in turn.

    Args:
        sensor: the Sensor.
        meter: the LeanMeter.
        seconds: any time in seconds.
    """
    if sensor.fault is not None:
        if seconds // 2 % 2 == 0:
            return words(sensor.fault)
        return "On its I2C bus:", " ".join(["%02x" % address for address in sensor.found]) or "nothing"
    chip, calibration, yes = sensor.chip, meter.calibration, ("no", "yes")
    facts = (
        "6pos %-3s ali %s" % (yes[calibration.six_done], yes[calibration.aligned]),
        "%d gaps %d starts" % (min(chip.overflows, 99), min(sensor.starts, 9)),
        "samples lost%4d" % min(sensor.clock.lost, 9999),
        "I2C address 0x%02x" % chip.address,
    )
    line1 = "%-9s%5.1f%sC" % (chip.name[:9], chip.temperature_c(meter.reading[3]), DEGREE)
    return line1, facts[seconds // 2 % 4]


class Menu:
    """The menu of a Screen, open from the beginning, and the information about the sensor below it.

    Args:
        screen: the Screen.
        app: the App.
        now_ms: ticks_ms().
    """

    def __init__(self, screen, app, now_ms):
        self._screen = screen
        self._app = app
        self._info = False  # True while the information is open
        self._open(now_ms)

    def _open(self, now_ms):
        self._shown = self._entries()  # the entries, the shown one first; () while the menu is closed
        self._due_ms = ticks_add(now_ms, _MENU_MS)

    @property
    def view(self):
        """The name of the view: "menu" or "info", or None when both are closed."""
        return "menu" if self._shown else "info" if self._info else None

    @property
    def entry(self):
        """The name of the entry that is shown, or None."""
        return self._shown[0][0] if self._shown else None

    @property
    def records(self):
        """True while the entry that begins a recording is shown."""
        return self.entry == "Record ride"

    def tick(self, now_ms):
        """Close the menu if it has waited too long for a press."""
        if ticks_diff(now_ms, self._due_ms) >= 0:
            self._shown = ()

    def lines(self, now_ms):
        """Return the two lines of the view."""
        if not self._shown:
            return sensor_info(self._app.sensor, self._app.meter, now_ms // 1000)
        count = len(self._shown)
        return _ARROW + self.entry, "next %d/%d hold=ok" % (count - self._shown.index(_LEAVE), count)

    def press(self, event, now_ms):
        """React to a press. event: SHORT or LONG."""
        if not self._shown:
            if event == LONG:
                self._open(now_ms)
            else:
                self._info = False
        elif event == LONG:
            self._choose()
        else:
            self._shown = self._shown[1:] + self._shown[:1]
            self._due_ms = ticks_add(now_ms, _MENU_MS)

    def _choose(self):
        _, function, needs_readings = self._shown[0]
        self._shown = ()
        fault = self._app.sensor.fault
        if needs_readings and fault is not None:
            self._app.notices.append(fault)
        elif function:
            function()

    def _entries(self):
        """Return the entries of the menu as a tuple of (name, function, True if it needs readings). A name has at most
        15 characters."""
        app = self._app
        entries = (("Align the bike", self._screen.align, True),) if app.settings.leans else ()
        by_drive = (("Align by drive", self._align_by_drive, True),) if app.drive else ()
        rest = (
            ("Six positions", self._six, True),
            ("Reset maxima", self._reset, False),
            ("Sensor info", self._show_info, False),
        )
        entries += rest + by_drive if app.settings.leans else by_drive + rest
        active = app.rides.recorder.active
        entries += (("Stop recording", self._stop, False) if active else ("Record ride", self._record, True),)
        if app.user and app.user.pages:
            entries += (("Own pages", self._show_own, False),)
        if app.live:
            entries += (("Stop Bluetooth", app.live.stop, False),)
        return entries + (_LEAVE,)

    def _six(self):
        gc.collect()  # as in Screen.align()
        from .six_wizard import SixWizard

        self._screen.wizard = SixWizard(self._app)

    def _reset(self):
        self._app.meter.reset_maxima()
        self._app.notices.append(Notice("maxima-reset"))

    def _show_info(self):
        self._info = True

    def _show_own(self):
        self._screen.turn_to(self._app.user.pages[0])

    def _align_by_drive(self):
        from .drive_page import drive

        self._app.drive.ask()
        self._screen.turn_to(drive)

    def _record(self):
        rides = self._app.rides
        rides.start()
        if rides.recorder.active:
            self._app.notices.append(Notice("recording", *recording(rides.recorder)))

    def _stop(self):
        self._app.rides.stop()
        self._app.notices.append(Notice("recording-ended"))
