"""Kickstand: a lean meter from an MPU6050 mounted at any angle.

>>> import kickstand
>>> kickstand.status()
"""

from .units import __version__ as __version__


def status(wirings=False):
    """Print what a user needs to know of this board: versions, settings, sensor, display, calibration.

    wirings: show each wiring of a character display's backpack on it for some seconds, with its number."""
    from . import status_report

    status_report.report(wirings)
