"""Constants that several packages share: the version, standard gravity, names of axes, and when readings no longer
follow on.

The sensor's axes are x, y, z as printed on the chip. The vehicle's are left, up, forward (A. Nicolae's x, y, z).
"""

__version__ = "0.4.0"
STANDARD_GRAVITY = 9.80665  # m/s^2 in 1 g
AXES = ("x", "y", "z")  # of the sensor
GAP_US = 500_000  # without a reading for longer, the past says nothing about the present
LOST_US = 170_000  # a longer step spans lost readings: the loop takes at most eight at once, 160 ms at 50 a second
