"""Constants that several packages share: the version, standard gravity, names of axes, limits of gaps in the readings.

The sensor's axes are x, y, z as printed on the chip. The vehicle's axes are left, up, forward (A. Nicolae's x, y, z).
"""

__version__ = "0.4.0"
STANDARD_GRAVITY = 9.80665  # m/s^2 in 1 g
AXES = ("x", "y", "z")  # names of the sensor's axes
GAP_US = 500_000  # after a longer time without a reading the estimators restart
# A longer time between two passes with readings means that readings were lost. One pass takes at most eight readings,
# which span 160 ms at 50 readings per second.
LOST_US = 170_000


def const(value):
    """Return the value.

    MicroPython's compiler recognises _NAME = const(value) at the top level of a module. The compiler puts the value
    into the code, and the name takes no heap. This module defines const() because CPython has no module micropython."""
    return value
