"""Kickstand: a lean meter from an MPU6050 mounted at any angle.

>>> import kickstand
>>> kickstand.status()
"""

import gc

__version__ = "0.2.0"

# While modules are loaded: what that leaves would push what stays to the far end of the heap, and make every later
# collection long.
gc.threshold(32_768)


def status():
    """Print what a user needs to know of this board: versions, settings, sensor, display, calibration."""
    from . import status_report

    status_report.report()
