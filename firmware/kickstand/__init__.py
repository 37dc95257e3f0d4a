"""Kickstand: a lean meter from an MPU6050 mounted at any angle.

>>> import kickstand
>>> kickstand.status()
"""

from .units import __version__ as __version__


def status(wirings=False):
    """Print a report of the board: versions, settings, sensor, display, button, speed, calibration, memory, flash.

    Stop the app first, because the report opens sensor and display, and writes a file to measure the flash.

    Args:
        wirings: True to show the number of each known backpack wiring on the character display for some seconds.
    """
    from . import status_report

    status_report.report(wirings)
