"""Kickstand: a lean meter from an MPU6050 mounted at any angle.

>>> import kickstand
>>> kickstand.status()
"""

__version__ = "0.4.0"


def status():
    """Print what a user needs to know of this board: versions, settings, sensor, display, calibration."""
    from . import status_report

    status_report.report()
