"""Starts Kickstand when the board has power.

Button held at power-up: safe mode, nothing is started, so that the board can always be deployed to.
"""

import sys
from time import sleep_ms

import machine
from kickstand import __version__, port
from kickstand.app import App, open_button, open_lcd
from kickstand.errors import SettingsError
from kickstand.settings import Settings


def load_settings():
    """config.py as Settings. Raises SettingsError; a missing config.py means the defaults."""
    try:
        import config
    except ImportError:
        config = None
    except Exception as error:  # a slip of the pen in the user's file is no reason for a traceback
        raise SettingsError("config.py cannot be read: %s" % error, "config.py has an", "error: see README")
    return Settings(config)


def tell(lcd, line1, line2=""):
    """Say something on the display, now."""
    lcd.show(line1, line2)
    lcd.flush()


def main():
    """Run until Ctrl-C, power-off or a reset."""
    try:
        settings = load_settings()
        lcd = open_lcd(settings)
        if open_button(settings).held():
            print("Kickstand %s: safe mode, the button was held at power-up." % __version__)
            tell(lcd, "Safe mode", "Ready for USB")
            return
        tell(lcd, "Kickstand", "starting")  # what stood there before a reset must not pass for a reading
        run(settings, lcd)
    except SettingsError as error:
        print("Kickstand stopped. " + error.reason)
        tell(open_lcd(Settings()), *error.lcd)
    except KeyboardInterrupt:
        port.rest_watchdog()
        print(
            "Kickstand stopped. Ctrl-D starts it again; import kickstand; kickstand.status() tells how it is."
        )


def run(settings, lcd):
    """The app; an exception in it is reported, then the board restarts."""
    print("Kickstand %s. Ctrl-C stops it." % __version__)
    try:
        App(settings, lcd).run()
    except SettingsError:
        raise
    except Exception as error:
        sys.print_exception(error)
        tell(lcd, "Error, restarts", type(error).__name__)
        sleep_ms(3000)
        machine.reset()


if __name__ == "__main__":
    main()
