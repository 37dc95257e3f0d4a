"""The parameters of a calibration and an alignment, and their use for raw counts.

The calibration converts counts to specific force (g) and angular rate (deg/s). The alignment rotates the sensor's axes
into the vehicle's axes. A Transform does both in one step.
"""

from array import array
from math import radians

from ..quick import load
from ..rotation import is_identity, matrix, product, rotate, vector
from ..units import const

# Limits of plausible parameters. The data sheet allows an offset of 50 to 80 mg and a scale error of 3 %, but real
# boards exceed both.
MAX_OFFSET_G = 0.5
MIN_SLOPE, MAX_SLOPE = 0.8, 1.2
MAX_MATRIX_ERROR = 0.15  # largest difference between an entry of accel_matrix or gyro_matrix and the identity matrix
MAX_GYRO_SIGMA = 0.05
# Smallest standard error of a gyro_matrix that was found while riding, because the errors change until the next ride
# with the temperature. The data sheet allows 2 % from -40 to 85 C.
MIN_GYRO_SIGMA = 0.006
_UNKNOWN = (0.0,) * 9
# The integer that represents the largest scale. The product of this integer and the sum of eight samples still fits in
# 32 bits.
_ONE = const(2048)


def _multiplying():
    arguments = array("i", range(2047, -2047, -171)), array("i", range(-260000, 260000, 74300)), 8, array("i", range(6))
    return arguments, 0xFFFD0C53


(products,) = load("quick_viper", ("products", _multiplying))
del _multiplying


class Calibration:
    """The parameters of one mounted sensor. The defaults change nothing: offset 0, slope 1, bias 0, identity matrices.

    The parameters are used as follows (Nicolae's equations 18-20, extended by two matrices):

        force = accel_matrix * (accel_slope * reading + accel_offset)
        rate = gyro_matrix * (reading - gyro_bias)

    All matrices are lists of 9 numbers, row by row.

    Attributes:
        accel_offset: offset of each axis of the accelerometer (3 values), in g.
        accel_slope: slope of each axis of the accelerometer (3 values).
        accel_matrix: cross-axis errors of the accelerometer.
        gyro_bias: the gyro's reading at rest (3 values), in deg/s.
        gyro_matrix: scale and cross-axis errors of the gyro.
        gyro_sigma: standard error of each entry of gyro_matrix (9 values); 0 if not measured.
        vehicle_from_sensor: the alignment, a rotation matrix with the rows left, up, forward.
        trim_deg: the correction of the roll misalignment, found while riding. Without this correction the lean would be
            this many degrees too far to the right.
        six_done: True if offset and slope were measured.
        aligned: True if vehicle_from_sensor was measured.
        by_drive: True if the alignment was measured or refined by driving.
    """

    def __init__(self):
        self.accel_offset = vector()
        self.accel_slope = vector(1.0, 1.0, 1.0)
        self.gyro_bias = vector()
        self.accel_matrix, self.gyro_matrix = matrix(), matrix()
        self.gyro_sigma = matrix(_UNKNOWN)
        self.vehicle_from_sensor = matrix()
        self.trim_deg = 0.0
        self.six_done = False
        self.aligned = False
        self.by_drive = False
        self.set_scale(1.0, 1.0)

    def with_alignment(self, vehicle_from_sensor, gyro_bias, trim_deg=0.0, by_drive=False):
        """Return a new Calibration with the same offset, slope and matrices, and with another alignment.

        Args:
            vehicle_from_sensor, gyro_bias, trim_deg, by_drive: the attributes of the new Calibration.
        """
        new = Calibration()
        new.set_accel(self.accel_offset, self.accel_slope)
        new.set_matrices(self.matrices())
        new.six_done = self.six_done
        new.aligned = True
        new.by_drive = by_drive
        new.trim_deg = trim_deg
        new.vehicle_from_sensor = matrix(vehicle_from_sensor)
        new.gyro_bias = vector(*gyro_bias)
        return new

    def set_scale(self, accel_lsb_per_g, gyro_lsb_per_dps):
        """Set the counts per g and per deg/s of the next readings. Before the first call both numbers are 1."""
        self._accel_lsb = accel_lsb_per_g
        self.set_accel(self.accel_offset, self.accel_slope)
        self._gyro_scale = 1.0 / gyro_lsb_per_dps

    def set_accel(self, offset, slope):
        """Set accel_offset and accel_slope."""
        self.accel_offset, self.accel_slope = vector(*offset), vector(*slope)
        self._scale = vector(*[value / self._accel_lsb for value in slope])

    def parameters(self):
        """Return 19 numbers: accel_offset (3), accel_slope (3), gyro_bias (3), vehicle_from_sensor (9), trim_deg."""
        measured = list(self.accel_offset) + list(self.accel_slope) + list(self.gyro_bias)
        return measured + list(self.vehicle_from_sensor) + [self.trim_deg]

    def set_parameters(self, values):
        """Set the 19 numbers, in the order of parameters()."""
        self.set_accel(values[0:3], values[3:6])
        self.gyro_bias = vector(*values[6:9])
        self.vehicle_from_sensor = matrix(values[9:18])
        self.trim_deg = values[18]

    @property
    def whole(self):
        """Return True if the matrices were measured."""
        return any(self.gyro_sigma) or not (is_identity(self.accel_matrix) and is_identity(self.gyro_matrix))

    def matrices(self):
        """Return 27 numbers: accel_matrix (9), gyro_matrix (9), gyro_sigma (9)."""
        return list(self.accel_matrix) + list(self.gyro_matrix) + list(self.gyro_sigma)

    def set_matrices(self, values):
        """Set the 27 numbers, in the order of matrices()."""
        self.accel_matrix, self.gyro_matrix = matrix(values[0:9]), matrix(values[9:18])
        self.gyro_sigma = matrix(values[18:27])

    def correct_gyro(self, errors, sigma):
        """Remove errors of the gyro that were found while riding from gyro_matrix.

        Args:
            errors: reading of axis i per rate about axis j, in the vehicle's axes; 9 values, row by row.
            sigma: their standard error. A smaller gyro_sigma, as from the six positions, stays.

        Returns False, and changes nothing, if the new matrix is not plausible.
        """
        to_vehicle, corrected, turned = self.vehicle_from_sensor, matrix(), matrix()
        product(turned, matrix([one - error for one, error in zip(matrix(), errors)]), to_vehicle)
        product(corrected, matrix([to_vehicle[3 * (i % 3) + i // 3] for i in range(9)]), turned)
        product(turned, corrected, self.gyro_matrix)
        if max([abs(value - one) for value, one in zip(turned, matrix())]) > MAX_MATRIX_ERROR:
            return False
        sigma = max(MIN_GYRO_SIGMA, min(MAX_GYRO_SIGMA, sigma))
        self.gyro_matrix = turned
        self.gyro_sigma = matrix([min(earlier or sigma, sigma) for earlier in self.gyro_sigma])
        return True

    def scales(self):
        """Return the units of one count.

        Returns:
            accel: g per count of each axis of the accelerometer (3 values), including the slope.
            gyro: deg/s per count of the gyro.
        """
        return self._scale, self._gyro_scale

    def in_vehicle(self):
        """Return calibration and alignment combined, as matrices and offsets for raw counts.

        The results combine Nicolae's equations (18)-(20), accel_matrix and gyro_matrix, and equation (15). The results
        convert a reading with 18 multiplications:

            force = force_matrix * counts + force_offset
            rate = rate_matrix * counts + rate_offset

        Returns:
            force_matrix: 9 values, in g per count.
            force_offset: 3 values, in g.
            rate_matrix: 9 values, in deg/s per count.
            rate_offset: 3 values, in deg/s.
        """
        of_force, of_rate = matrix(), matrix()
        product(of_force, self.vehicle_from_sensor, self.accel_matrix)
        product(of_rate, self.vehicle_from_sensor, self.gyro_matrix)
        force_offset, rate_offset = [0.0] * 3, [0.0] * 3
        rotate(force_offset, of_force, self.accel_offset)
        rotate(rate_offset, of_rate, [-bias for bias in self.gyro_bias])
        force = [of_force[i] * self._scale[i % 3] for i in range(9)]
        return force, force_offset, [value * self._gyro_scale for value in of_rate], rate_offset

    def apply(self, reading, force, rate):
        """Calibrate one reading. The results are in the sensor's axes.

        Args:
            reading: 7 counts in the chip's order: accelerometer (3), temperature, gyro (3).
            force: list of 3 for the resulting force, in g.
            rate: list of 3 for the resulting rate, in deg/s.
        """
        for i in range(3):
            force[i] = self._scale[i] * reading[i] + self.accel_offset[i]
            rate[i] = self._gyro_scale * reading[4 + i] - self.gyro_bias[i]
        if self.whole:
            rotate(force, self.accel_matrix, force)
            rotate(rate, self.gyro_matrix, rate)


class Transform:
    """Converts sums of counts to the vehicle's force and rate, by calibration and alignment combined in one step.

        force = R A (slope * counts / lsb + offset)        Nicolae's equations (18)-(20), then (15)
        rate  = R G (counts / lsb - bias)

    R is vehicle_from_sensor, A is accel_matrix, and G is gyro_matrix. The combined step takes 18 products per sample
    instead of 27. On the board a product of floats takes 12 us and 32 bytes of heap. So products() of quick_viper.py
    multiplies integers. The rounding causes an error of at most 0.03 degrees of lean.

    Args:
        calibration: a Calibration after set_scale(). Changes to the Calibration after that have no effect.
    """

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
