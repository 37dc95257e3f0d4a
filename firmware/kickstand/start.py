"""Starts the lean meter. main.py runs it when the board gets power.

Safe mode: if the button is held at power-on, nothing is started. In safe mode new firmware can always be copied. After
a reset the button is ignored. Without this rule a press while an error is shown could leave the rider without a
display.
"""

import gc
import sys
from time import sleep_ms, ticks_ms

import machine

from .board import port

port.begin()  # before the other imports, which make lasting objects
from . import settings  # noqa: E402
from .board.display import STOPPED  # noqa: E402
from .errors import Notice, Refusal, SettingsError, report, tried  # noqa: E402
from .units import __version__, const  # noqa: E402

# A capacitor for debouncing between pin and ground looks like a press at power-on, until the pin's weak pull-up has
# charged it. 1 uF through 80 kOhm takes 75 ms.
_CHARGE_MS = const(100)

# The modules that the app imports, in this order. Between two imports the set-up of display and chip advances by a
# step. MicroPython cannot run code between the imports of other modules, so this list repeats them. A test compares the
# list with the import statements.
STEPS = (
    "calibration.parameters calibration.store calibration.active lean.bike_model lean.kalman lean.measurements "
    "lean.lean_filter lean.meter ui.pages ui.screen rides.rides"
).split()


def _show(lcd, line1, line2=""):
    """Show two lines on the display, at once."""
    lcd.show(line1, line2)
    lcd.flush()


def main(loop=None, closed_ms=5000):
    """Run until Ctrl-C, power-off or a reset. An exception is reported on display and console, then the board restarts.

    Args:
        loop: a function that is called with the App instead of App.run(), or None. A simulation uses such a function to
            call App.begin() and App.step() later.
        closed_ms: time for which the button must be held in safe mode until the display says that it is closed. 0 in a
            simulation in which nobody can release the button meanwhile.
    """
    lcd = None
    try:
        chosen = settings.load()
        lcd = chosen.open_lcd()
        if machine.reset_cause() == machine.PWRON_RESET:
            button = chosen.open_button()
            if button.held():
                sleep_ms(_CHARGE_MS)
            if button.held():
                _safe_mode(lcd, button, chosen.BUTTON_PIN, closed_ms)
                return
        lcd.show("Kickstand", "starting")  # replace a lean that was shown before a reset
        run(chosen, lcd, loop)
    except SettingsError as error:
        # the watchdog may be running, because the app finds some wrong pins only when it opens them
        port.rest_watchdog()
        from .console import sentence
        from .ui.messages import lines

        print("Kickstand stopped. " + sentence(error))
        _last_words(lcd, *lines(error), error.settings)
    except KeyboardInterrupt:
        port.rest_watchdog()
        if lcd:
            lcd.end(*STOPPED)
        print("Kickstand stopped. Ctrl-D starts it again; import kickstand; kickstand.status() reports how it is.")
    except ImportError as error:  # no restart, because the files are incomplete after an interrupted update
        port.rest_watchdog()
        print("Kickstand stopped: incomplete firmware (%s). Run kickstand flash." % error)
        _last_words(lcd, "Incomplete:", "flash it again")
    except Exception as error:
        sys.print_exception(error)
        _last_words(lcd, "Error, restarts", type(error).__name__)
        sleep_ms(3000)
        machine.reset()


def _safe_mode(lcd, button, pin, closed_ms):
    """Say on display and console that nothing is started. If the button is not released, say that it is closed."""
    print("Kickstand %s: safe mode, the button was held at power-up." % __version__)
    _show(lcd, "Safe mode", "Ready for USB")
    for _ in range(closed_ms // _CHARGE_MS):
        sleep_ms(_CHARGE_MS)
        if not button.held():
            return
    if closed_ms:
        print("The button on GPIO %d stays closed: check its wires; turn a button with four legs by 90 degrees." % pin)
        _show(lcd, "Button is closed", "check its wires")


def _last_words(lcd, line1, line2, chosen=None):
    """Show two lines when the firmware ends.

    Args:
        lcd: the Display, or None if it is not open yet.
        chosen: the Settings for opening the display; None for the default pins.
    """
    try:
        if lcd is None:
            sys.modules.pop("config", None)  # config.py itself may have used up the memory
            gc.collect()
            lcd = (chosen or settings.Settings()).open_lcd()
        _show(lcd, line1, line2)
    except Exception:  # wrong pins, short memory or a missing file; the console already has the message
        pass


def _open_radio(pin):
    from .live.radio import Radio

    return Radio(pin)


def _open_live(radio, app):
    from .live.live import Live

    return Live(radio, app)


def _live(notices, function, *arguments):
    """Do a step of LIVE and return its result. Report an error: the lean meter continues in any case."""
    try:
        result, notice = tried(function, *arguments)
    except Refusal as error:
        result, notice = None, error
    if notice:
        memory = notice.code == "no-memory"
        report(Notice("live-memory", *notice.values) if memory else notice, notices)
    return result


def run(chosen, lcd, loop=None):
    """Run the app.

    Args:
        chosen: the Settings.
        lcd: the Display.
        loop: as for main().
    """
    notices = []
    # The radio comes first, because an ESP32-C3 may crash if its radio is switched on after 40 KB are allocated
    radio = _live(notices, _open_radio, chosen.LIVE_PIN) if chosen.LIVE else None
    sensor = chosen.open_sensor()
    for name in STEPS + ["app"]:
        now_ms = ticks_ms()
        lcd.tick(now_ms)
        sensor.prepare(now_ms)
        __import__("kickstand." + name)
    from .app import App

    print("Kickstand %s. Ctrl-C stops it." % __version__)
    app = App(chosen, lcd, sensor)
    if radio:
        app.live = _live(notices, _open_live, radio, app)
        if not app.live:
            radio.stop()
    app.notices.extend(notices)
    (loop or App.run)(app)
