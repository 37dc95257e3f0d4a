"""Converts the chip's counts to the vehicle's force and rate, by calibration and alignment combined in one step.

    force = R A (slope * counts / lsb + offset)        Nicolae's equations (18)-(20), then (15)
    rate  = R G (counts / lsb - bias)

R is vehicle_from_sensor, A is accel_matrix, and G is gyro_matrix. The combined step takes 18 products per sample
instead of 27. On the board a product of floats takes 12 us and 32 bytes of heap. So products() of quick_viper.py
multiplies integers. The rounding causes an error of at most 0.03 degrees of lean.
"""

from array import array
from math import radians

from ..quick import load
from ..units import const

# The integer that represents the largest scale. The product of this integer and the sum of eight samples still fits in
# 32 bits.
_ONE = const(2048)


def _multiplying():
    arguments = array("i", range(2047, -2047, -171)), array("i", range(-260000, 260000, 74300)), 8, array("i", range(6))
    return arguments, 0xFFFD0C53


(products,) = load("quick_viper", ("products", _multiplying))
del _multiplying


class Transform:
    """Applies a Calibration to sums of counts.

    Call the Calibration's set_scale() first. Changes to the Calibration after that have no effect."""

    def __init__(self, calibration):
        force, force_offset, rate, rate_offset = calibration.in_vehicle()
        scale, gyro_scale = calibration.scales()
        force_unit, rate_unit = max(scale) / _ONE, gyro_scale / _ONE
        self._integers, self._products = array("i", [0] * 24), array("i", [0] * 6)
        for i in range(12):
            row, k = i // 4, i % 4
            self._integers[i] = round((force[3 * row + k] if k < 3 else force_offset[row]) / force_unit)
            self._integers[12 + i] = round((rate[3 * row + k] if k < 3 else rate_offset[row]) / rate_unit)
        self._force_unit, self._rate_unit = force_unit, radians(rate_unit)

    def apply_sum(self, sums, n, force, rate):
        """Compute the mean force and the mean rate of some samples.

        Args:
            sums: sums of the samples' counts in the chip's order, array('i', 7).
            n: number of samples, at most 8.
            force: list of 3 for the mean force to the left, up and forward, in g.
            rate: list of 3 for the mean rate about left, up and forward, in rad/s.
        """
        p = self._products
        products(self._integers, sums, n, p)
        unit = self._force_unit / n
        force[0] = unit * p[0]
        force[1] = unit * p[1]
        force[2] = unit * p[2]
        unit = self._rate_unit / n
        rate[0] = unit * p[3]
        rate[1] = unit * p[4]
        rate[2] = unit * p[5]
