"""From the chip's counts to the vehicle's force and rate in one step: calibration and alignment multiplied out.

    force = R (slope * counts / lsb + offset)          Nicolae's equations (18)-(20), then (15)
    rate  = R (counts / lsb - bias)                    R: vehicle_from_sensor

That takes eighteen products a sample instead of twenty-seven. On the board a product of floats takes 12 us and 32 bytes
of heap, so there they are products of integers in machine code, which are right to 0.03 degrees of lean.
"""

from array import array
from math import radians

from ..rotation import rotate

ONE = 2048  # the integer that stands for the largest scale: times the sum of eight samples it still fits 32 bits


def products_python(matrices, sums, n, out):
    """out[0:3] = A (sums[0:3], n) and out[3:6] = B (sums[4:7], n), where n multiplies the offsets.

    matrices: array('i', 24), the 3x4 matrices A and B by rows.  sums: array('i', 7).  out: array('i', 6). On the board
    products() is the machine code of transform_viper.py, elsewhere this.
    """
    for i in range(6):
        first = 0 if i < 3 else 4
        out[i] = n * matrices[4 * i + 3]
        for k in range(3):
            out[i] += matrices[4 * i + k] * sums[first + k]


try:
    from .transform_viper import products
except (ImportError, NameError, SyntaxError):  # CPython, or a port without viper
    products = products_python


class Transform:
    """calibration: a Calibration whose set_scale() was called; later changes to it are not seen."""

    def __init__(self, calibration):
        # Lists, because on the board reading a float from an array takes heap, and from a list it does not.
        self._force, self._rate = [0.0] * 9, [0.0] * 9
        self._force_offset, self._rate_offset = [0.0] * 3, [0.0] * 3
        r = calibration.vehicle_from_sensor
        scale, gyro_scale = calibration.scales()
        self._force_unit, self._rate_unit = max(scale) / ONE, radians(gyro_scale) / ONE
        for i in range(9):
            self._force[i] = r[i] * scale[i % 3]
            self._rate[i] = r[i] * radians(gyro_scale)
        rotate(self._force_offset, r, calibration.accel_offset)
        rotate(self._rate_offset, r, [-radians(bias) for bias in calibration.gyro_bias])
        self._integers, self._products = array("i", [0] * 24), array("i", [0] * 6)
        for i in range(12):
            row, k = i // 4, i % 4
            force = self._force[3 * row + k] if k < 3 else self._force_offset[row]
            rate = self._rate[3 * row + k] if k < 3 else self._rate_offset[row]
            self._integers[i] = round(force / self._force_unit)
            self._integers[12 + i] = round(rate / self._rate_unit)

    def apply(self, reading, force, rate):
        """Put the force and rate of a reading into force and rate.

        reading: 7 numbers in counts, in the chip's order.  force: 3, left, up, forward in g.  rate: 3, about the same
        axes in rad/s."""
        m, c = self._force, self._force_offset
        x, y, z = reading[0], reading[1], reading[2]
        force[0] = m[0] * x + m[1] * y + m[2] * z + c[0]
        force[1] = m[3] * x + m[4] * y + m[5] * z + c[1]
        force[2] = m[6] * x + m[7] * y + m[8] * z + c[2]
        m, c = self._rate, self._rate_offset
        x, y, z = reading[4], reading[5], reading[6]
        rate[0] = m[0] * x + m[1] * y + m[2] * z + c[0]
        rate[1] = m[3] * x + m[4] * y + m[5] * z + c[1]
        rate[2] = m[6] * x + m[7] * y + m[8] * z + c[2]

    def apply_sum(self, sums, n, force, rate):
        """The same for the mean of n samples, at most 8, given the sums of their counts: array('i', 7)."""
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
