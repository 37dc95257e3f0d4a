"""What the display shows, and what a press of the button does.

A page is a function that returns two lines of 16 characters. To add a page called load, write load(), and add it to
MOTORCYCLE or CAR. CONTRIBUTING.md has the other steps.

The display shows the view in front. A notice is before all other views. Then follow a guided calibration, the menu, the
information about the sensor, a fault of the sensor, a message of the alignment by driving, and the page.
"""

import gc
from time import ticks_add, ticks_diff

from ..board.button import LONG, SHORT
from ..board.display import DEGREE
from ..errors import Notice, attempt
from ..lean.bike_model import static_lean_deg
from ..rotation import vector
from ..units import const

ARROW = "\x7e"  # code of an arrow in the display's character ROM
RECORDING = "*"
_HALF_BAR = const(8)  # number of character cells on each side of the middle
# Code 0xFF is a full cell in the display's character ROM
_EMPTY_THEN_FULL = b"        \xff\xff\xff\xff\xff\xff\xff\xff"
_FULL_THEN_EMPTY = b"\xff\xff\xff\xff\xff\xff\xff\xff        "
_DEG_PER_COLUMN = 1.5  # degrees of lean per dot column; the bar ends at 60 degrees, because it has 8 cells of 5 columns

_NOTICE_MS = const(2000)
_MENU_MS = const(20_000)  # time without a press after which the menu closes

FALLEN = ("Fallen over?", "Lean over 65" + DEGREE)

# The words that are shown instead of the lean. The keys are values of LeanMeter.suppressed_reason while the alignment
# is in doubt, and of LeanMeter.odd.
NO_LEAN = {
    "other-side": "side was wrong?",
    "mount-moved": "mount has moved",
    "turned": "SIDE or presses?",
    "odd-left": "sensor odd: left",
    "odd-up": "sensor odd: up",
    "odd-pitch": "sensor odd: tilt",
}

_bar = bytearray(16)


def words(notice):
    """Return the two lines for a Notice or a Refusal. Without memory for the words, return its code."""
    try:
        from .messages import lines  # imported at the first notice, because it takes 4 KB of heap

        return lines(notice)
    except (ImportError, MemoryError):
        return notice.code, ""


def unsure(reason):
    """Return the two lines that replace a lean that is not trusted.

    Args:
        reason: the code of the reason, or None.
    """
    return "Lean  --", NO_LEAN.get(reason, "not sure yet")


def lean_bar(lean_deg):
    """Return a bar from the middle to the side of the lean, as 16 character codes.

    The codes 0 to 3 are glyphs with 1 to 4 dot columns filled from the left. The codes 4 to 7 are glyphs with 1 to 4
    dot columns filled from the right."""
    columns = min(5 * _HALF_BAR, int(abs(lean_deg) / _DEG_PER_COLUMN + 0.5))
    # the innermost dot column of each side is always on, to mark the middle
    right, left = (columns or 1, 1) if lean_deg > 0 else (1, columns or 1)
    full, rest = right // 5, right % 5
    _bar[_HALF_BAR:] = _FULL_THEN_EMPTY[_HALF_BAR - full : 2 * _HALF_BAR - full]
    if rest:
        _bar[_HALF_BAR + full] = rest - 1
    full, rest = left // 5, left % 5
    _bar[:_HALF_BAR] = _EMPTY_THEN_FULL[full : _HALF_BAR + full]
    if rest:
        _bar[_HALF_BAR - 1 - full] = rest + 3
    return _bar


def side_name(lean_deg):
    """Return "left" or "right", or "" within half a degree of upright."""
    return "right" if lean_deg >= 0.5 else "left" if lean_deg <= -0.5 else ""


def lean(meter):
    """The page with the lean, its side and its bar."""
    shown = meter.lean_deg
    return "Lean %3d%s %s" % (int(abs(shown) + 0.5), DEGREE, side_name(shown)), lean_bar(shown)


def recorded(line):
    """Return the line with the recording mark in its last column."""
    # padded by hand, because MicroPython's %-15s counts a degree sign as two bytes
    return line + " " * (15 - len(line)) + RECORDING


def recording(recorder):
    """The page with the duration of the recording, and the time until its beginning is erased."""
    seconds, room_s = recorder.seconds(), recorder.room_s()
    if room_s is None:
        room = "to USB"
    elif room_s == 0:
        room = "oldest is erased"
    else:
        room = "room %d min" % (room_s // 60) if room_s < 36_000 else "room %d h" % (room_s // 3600)
    return "Rec %9d:%02d" % (seconds // 60, seconds % 60), room


def maxima(meter):
    """The page with the largest lean to each side since the last reset of the maxima."""
    left, right = int(meter.max_left_deg + 0.5), int(meter.max_right_deg + 0.5)
    return "Max left   %3d%s" % (left, DEGREE), "Max right  %3d%s" % (right, DEGREE)


def acceleration(meter):
    """The page with acceleration or braking in g, and the peaks of both."""
    forward = meter.smooth_force[2]
    word = "Brake" if forward < -0.005 else "Accel"
    return "%s   %5.2f g" % (word, abs(forward)), "pk +%.2f / -%.2f" % (meter.max_accel_g, meter.max_brake_g)


def cornering(meter):
    """The page with the lateral and the vertical g of a car."""
    left = meter.smooth_force[0]
    side = "Left" if left > 0.005 else "Right"
    return "%-5s   %5.2f g" % (side, abs(left)), "Up      %5.2f g" % meter.smooth_force[1]


def formula(meter):
    """The page with the lean by Nicolae's formula as published, and the filter's lean for comparison."""
    leans = round(meter.lean_formula_deg), round(meter.lean_deg)
    return "Formula   %4d%s" % (leans[0], DEGREE), "Filter    %4d%s" % (leans[1], DEGREE)


def raw(meter):
    """The page with the calibrated readings in the sensor's own axes."""
    force, rate = vector(), vector()
    meter.calibration.apply(meter.reading, force, rate)
    rates = "%4d%4d%4d %s/s" % (int(rate[0]), int(rate[1]), int(rate[2]), DEGREE)
    return "%5.2f%5.2f%5.2fg" % tuple(force), rates


def not_aligned(meter, seconds, todo):
    """The page before the alignment, with tilt and g in the sensor's own axes (Nicolae's figure 3).

    Args:
        seconds: any time in seconds. Every two seconds the second line changes between "Not aligned" and `todo`.
        todo: the next step for the rider.
    """
    tilt = static_lean_deg(meter.smooth_force)
    hint = "Not aligned" if seconds % 4 < 2 else todo
    return "Raw %4d%s %+.2fg" % (round(tilt), DEGREE, meter.smooth_force[2]), hint


def live(phone):
    """The page with the receiver of the packets to a phone. phone: the Live."""
    return phone.lines()


def drive(background, now_ms):
    """The page with the state, the progress and the result of alignment by driving.

    Args:
        background: a BackgroundAlignment.
        now_ms: ticks_ms().
    """
    from ..drive_alignment import alignment

    drive, state = background.drive, background.state()
    if drive.problem is not None:
        return words(drive.problem)
    if background.result and (drive.ready or not drive.counted):
        return words(background.result)
    if state == alignment.READY:
        return "Ready:", "stop to save it"
    if state == alignment.WAITING_FOR_SPEED:
        fault = background.speed.source.fault(now_ms)
        return words(fault) if fault else ("Align by drive", "waiting: speed")
    # for the states from WAITING_FOR_STOP to TURNING
    waiting = ("stop needed", "brake straight", "braking...", "turn not counted")[state - alignment.WAITING_FOR_STOP]
    if drive.counted < drive.needed:
        return "Brakings %3d/%d" % (drive.counted, drive.needed), waiting
    return "Brake%3d +-%4.1f%s" % (drive.counted, min(drive.quality_deg, 99.9), DEGREE), waiting


def sensor_info(sensor, meter, seconds):
    """The page with information about the sensor. The page changes every two seconds.

    The first line has the chip's name and temperature. The second line shows these in turn:
    * which parts are calibrated
    * the number of overflows of the FIFO, and the number of set-ups of the chip
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


MOTORCYCLE = (lean, maxima, acceleration, formula, raw)
CAR = (acceleration, cornering, raw)


class Screen:
    """The views of an App.

    tick() follows what has happened, lines() reads what to show.

    Attributes:
        view: the name of the view in front: "notice", "align", "six", "menu", "info", "fault", "question", or the name
            of a page, which is "own" for a page of the board's owner.
        shown: the Notice or Refusal in front, or None. A wizard has its own.
        notice: the Notice before all other views, or None. It disappears after two seconds, or with a press.
        wizard: the current AlignWizard or SixWizard, which takes every sample, or None.
        entry: the name of the menu's entry that is shown, or None.
    """

    def __init__(self, app):
        self._app = app
        self._pages = MOTORCYCLE if app.settings.leans else CAR
        self._at = 0  # index of the page in the ring
        self._menu = None  # the entries of the open menu, the shown entry first
        self._info = False  # True while the information about the sensor is open
        self.notice = self.wizard = None
        self._glance = None  # the module glance, or False if it cannot be loaded
        self._update()

    @property
    def entry(self):
        return self._menu[0][0] if self._menu else None

    def tick(self, now_ms):
        """Drop what has ended, and take the next notice. Call this method about every 100 ms, before lines()."""
        app = self._app
        if self.notice and ticks_diff(now_ms, self._notice_ms) >= 0:
            self.notice = None
        if app.notices and not self.notice:
            self.notice, self._notice_ms = app.notices.pop(0), ticks_add(now_ms, _NOTICE_MS)
        if self._menu and ticks_diff(now_ms, self._menu_ms) >= 0:
            self._menu = None
        self._update()
        if self.view == "question":
            self._at = 0  # the page that is shown after the rider's answer

    def _update(self):
        """Find the view in front."""
        app = self._app
        if self.wizard and self.wizard.ended:
            self.wizard = None
        ring = self._ring()
        self._at %= len(ring)
        self._page = page = ring[self._at]
        self.shown = None
        if self.notice:
            self.view, self.shown = "notice", self.notice
        elif self.wizard:
            self.view = self.wizard.name
        elif self._menu:
            self.view = "menu"
        elif self._info:
            self.view = "info"
        elif app.sensor.fault is not None:
            self.view, self.shown = "fault", app.sensor.fault
        elif app.drive and app.drive.message:
            self.view, self.shown = "question", app.drive.message
        else:
            self.view = "own" if app.user and page in app.user.pages else page.__name__

    def _ring(self):
        """Return the pages in the order of short presses: this module's functions, then the owner's."""
        app = self._app
        ring = (drive,) if app.drive and app.drive.shown else ()
        if app.calibration.aligned:
            ring = self._pages + ring
            if app.live:
                ring += (live,)
            if app.rides.recorder.active:
                ring += (recording,)
        else:
            ring += (not_aligned,)
        return ring + tuple(app.user.pages) if app.user else ring

    def lines(self, now_ms):
        """Return the content of the display: two lines and, for a display that draws, a picture."""
        app, view = self._app, self.view
        if self.shown:
            return words(self.shown)
        if self.wizard:
            return self.wizard.lines
        if view == "menu":
            count = len(self._menu)
            return ARROW + self.entry, "next %d/%d hold=ok" % (count - self._menu.index(_LEAVE), count)
        if view == "info":
            return sensor_info(app.sensor, app.meter, now_ms // 1000)
        page = self._page
        if view == "own":
            return page()
        if view == "drive":
            return page(app.drive, now_ms)
        if view == "live":
            return app.live.lines()
        if view == "recording":
            return page(app.rides.recorder)
        if view == "not_aligned":
            todo = "drive and brake" if drive in self._ring() else "On stand: press"
            return page(app.meter, now_ms // 1000, todo)
        return self._readings(page)

    def _readings(self, page):
        """Return the lines of a page with readings, and its picture."""
        app, meter, glance = self._app, self._app.meter, self._pictures()
        if meter.fallen:
            return FALLEN
        if app.shown_deg is None:
            lines = unsure(meter.suppressed_reason or meter.odd)
            return lines + (glance.unsure(*lines),) if glance else lines
        line1, line2 = page(meter)
        recording = page is self._pages[0] and app.rides.recorder.active
        if recording:
            line1 = recorded(line1)
        if glance and self.view in glance.PICTURES:
            return line1, line2, glance.PICTURES[self.view](meter, recording, line2)
        return line1, line2

    def _pictures(self):
        """Return the module glance if the display draws and the module can be loaded, else None."""
        if self._app.lcd.draws and self._glance is None:
            self._glance = False
            attempt(None, self._load)
        return self._app.lcd.draws and self._glance

    def _load(self):
        from . import glance

        self._glance = glance

    def press(self, event, now_ms):
        """React to a press.

        If the press needs missing modules or too much memory, the rider gets a notice and the ride continues.

        Args:
            event: SHORT or LONG.
            now_ms: ticks_ms().
        """
        self.tick(now_ms)
        attempt(self._app.notices, self._press, event, now_ms)
        self.tick(now_ms)

    def guide(self, n, dt_us, now_ms):
        """Pass the samples and the time to the wizard, once per pass of the loop. If memory is too short, the wizard
        ends with a notice.

        Args:
            n: number of new samples, which the chip has, or 0.
            dt_us: microseconds since the previous samples.
            now_ms: ticks_ms().
        """
        if attempt(self._app.notices, self.wizard.follow, n, dt_us, now_ms):
            self.wizard = None
            self._update()

    def _press(self, event, now_ms):
        if self.notice:  # the press ends the notice and is for the view below
            self.notice = None
            self._update()
            if self.view == "question":  # the rider has not seen the question yet, so the press is not its answer
                return
        if self.wizard:
            self.wizard.press(event)
        elif self._menu:
            self._press_menu(event, now_ms)
        elif self.view == "question":
            self._app.drive.answer(event == LONG)
        elif event == LONG:
            self._menu, self._menu_ms = self._entries(), ticks_add(now_ms, _MENU_MS)
        elif self._info:
            self._info = False
        elif self.view == "not_aligned" and not self._at:
            self._align(True)  # the press means that the bike is on its kickstand
        elif self.view != "fault":
            self._at += 1

    def _press_menu(self, event, now_ms):
        if event == SHORT:
            self._menu = self._menu[1:] + self._menu[:1]
            self._menu_ms = ticks_add(now_ms, _MENU_MS)
            return
        _, function, needs_readings = self._menu[0]
        self._menu = None
        fault = self._app.sensor.fault
        if needs_readings and fault is not None:
            self._app.notices.append(fault)
        elif function:
            function()

    def _entries(self):
        """Return the entries of the menu as a tuple of (name, function, True if it needs readings). A name has at most
        15 characters."""
        app = self._app
        entries = (("Align the bike", self._align, True),) if app.settings.leans else ()
        drive = (("Align by drive", self._align_by_drive, True),) if app.drive else ()
        rest = (
            ("Six positions", self._six, True),
            ("Reset maxima", self._reset, False),
            ("Sensor info", self._show_info, False),
        )
        entries += rest + drive if app.settings.leans else drive + rest
        active = app.rides.recorder.active
        entries += (("Stop recording", self._stop, False) if active else ("Record ride", self._record, True),)
        if app.user and app.user.pages:
            entries += (("Own pages", self._show_own, False),)
        if app.live:
            entries += (("Stop Bluetooth", app.live.stop, False),)
        return entries + (_LEAVE,)

    def interrupt(self):
        """Cancel the guided calibration because the sensor has failed, unless the wizard can continue."""
        if self.wizard and not self.wizard.bears(self._app.sensor.fault):
            self.wizard = None
            self._update()  # state() may ask before the display changes
            self._app.notices.append(Notice("stopped"))

    # The wizards are imported only when needed, because with their own imports they take 12 KB of heap. Garbage is
    # collected before the import. Without this collection the new modules, which stay loaded, would be placed at the
    # far end of the heap and make each later collection longer.

    def _align(self, pressed=False):
        gc.collect()
        from .wizard import AlignWizard

        self._at = 0
        self.wizard = AlignWizard(self._app, pressed)

    def _six(self):
        gc.collect()
        from .six_wizard import SixWizard

        self.wizard = SixWizard(self._app)

    def _reset(self):
        self._app.meter.reset_maxima()
        self._app.notices.append(Notice("maxima-reset"))

    def _show_info(self):
        self._info = True

    def _show_own(self):
        self._at = self._ring().index(self._app.user.pages[0])

    def _align_by_drive(self):
        self._app.drive.ask()
        self._at = self._ring().index(drive)

    def _record(self):
        rides = self._app.rides
        rides.start()
        if rides.recorder.active:
            self._app.notices.append(Notice("recording", *recording(rides.recorder)))

    def _stop(self):
        self._app.rides.stop()
        self._app.notices.append(Notice("recording-ended"))


_LEAVE = ("Leave menu", None, False)
