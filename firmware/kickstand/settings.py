"""Loads and checks the settings in config.py. setting_table.py has their defaults and checks."""

import sys
from io import StringIO

from .errors import SettingsError, unload


def load():
    """Return the Settings of config.py, or the defaults without a config.py. Raises SettingsError."""
    config = refusal = None
    try:
        import config
    except ImportError:
        pass
    except Exception as error:  # config.py is the rider's code and may raise anything
        refusal = SettingsError("unreadable", "config.py", _line_of(error), str(error))
    return Settings(config, refusal)


def _line_of(error):
    """Return the place of an error in config.py, such as "line 3: ", or "" if the traceback does not show it."""
    text = StringIO()
    # the stubs for the type checker do not accept a StringIO here
    sys.print_exception(error, text)  # type: ignore[arg-type]
    traceback = text.getvalue()  # type: ignore[attr-defined]
    _, separator, tail = traceback.rpartition('config.py", line ')
    return "line %s: " % tail.split("\n")[0].split(",")[0].strip() if separator else ""


class Settings:
    """The settings. Each name in setting_table.py is an attribute. Raises SettingsError.

    Args:
        config: the module config, or None for the defaults.
        refusal: the SettingsError to raise if config.py cannot be read, else None.

    Attributes:
        one_bus: True if sensor and display share one I2C bus.
        leans: True if the vehicle leans (a motorcycle).
    """

    def __init__(self, config=None, refusal=None):
        try:
            from .setting_table import fill

            fill(self, config, refusal)
        except SettingsError as error:
            error.settings = self
            raise
        finally:
            unload("setting_table")  # which takes 8 KB of heap
            unload("board.pins")
