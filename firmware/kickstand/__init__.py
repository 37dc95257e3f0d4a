"""Kickstand: a lean meter from an MPU6050 mounted at any angle.

>>> import kickstand
>>> kickstand.status()
"""

from .units import __version__ as __version__


def status():
    """Print the facts about the board: versions, settings, sensor, display, button, speed, calibration, memory, flash.
    `kickstand status` says them in words.

    Stop the app first, because the report opens sensor and display, and writes a file to measure the flash.
    """
    from . import facts

    facts.report()
