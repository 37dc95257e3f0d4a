"""The parameters that convert counts to specific force (g) and angular rate (deg/s), and sensor axes to vehicle
axes."""

from ..rotation import is_identity, matrix, product, rotate, vector

# Limits of plausible parameters. The data sheet allows an offset of 50 to 80 mg and a scale error of 3 %; real boards
# exceed both.
MAX_OFFSET_G = 0.5
MIN_SLOPE, MAX_SLOPE = 0.8, 1.2
MAX_MATRIX_ERROR = 0.15  # largest difference of an entry of accel_matrix or gyro_matrix from the identity
MAX_GYRO_SIGMA = 0.05
_UNKNOWN = (0.0,) * 9


class Calibration:
    """The parameters of one mounted sensor. The defaults change nothing: offset 0, slope 1, bias 0, identity matrices.

    accel_offset (3, g) and accel_slope (3): calibrated = slope * reading + offset, Nicolae's equations 18-20.
    gyro_bias (3, deg/s): the gyro's reading at rest. accel_matrix, gyro_matrix (9, row-major): the remaining errors,
    force = accel_matrix * calibrated, and rate = gyro_matrix * (reading - bias). gyro_sigma (9): standard error of each
    entry of gyro_matrix, 0 if not measured. vehicle_from_sensor (9, row-major, rows left, up, forward): the alignment,
    a rotation matrix. trim_deg: the roll-misalignment correction found while riding: degrees by which the lean would
    read too far to the right. six_done: offset and slope were measured. aligned:
    vehicle_from_sensor was measured. by_drive: the alignment was measured or refined by driving.
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
        """Return a new Calibration with the same offset, slope and matrices, aligned by vehicle_from_sensor (9).
        gyro_bias: 3, deg/s."""
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
        """Set the counts per unit of the next readings. By default 1: readings are in g and deg/s."""
        self._accel_lsb = accel_lsb_per_g
        self.set_accel(self.accel_offset, self.accel_slope)
        self._gyro_scale = 1.0 / gyro_lsb_per_dps

    def set_accel(self, offset, slope):
        """Set offset (3, g) and slope (3)."""
        self.accel_offset, self.accel_slope = vector(*offset), vector(*slope)
        self._scale = vector(*[value / self._accel_lsb for value in slope])

    def parameters(self):
        """The 19 measured numbers: offset (3), slope (3), gyro bias (3), matrix (9), trim."""
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
        """accel_matrix, gyro_matrix and gyro_sigma: 27 numbers."""
        return list(self.accel_matrix) + list(self.gyro_matrix) + list(self.gyro_sigma)

    def set_matrices(self, values):
        """Set the 27 numbers, in the order of matrices()."""
        self.accel_matrix, self.gyro_matrix = matrix(values[0:9]), matrix(values[9:18])
        self.gyro_sigma = matrix(values[18:27])

    def correct(self, accel):
        """Calibrate a mean accelerometer reading (3, g); return a new array."""
        out = vector()
        rotate(out, self.accel_matrix, [self.accel_slope[i] * accel[i] + self.accel_offset[i] for i in range(3)])
        return out

    def correct_rate(self, gyro):
        """Calibrate a mean gyro reading (3, deg/s); return a new array."""
        out = vector()
        rotate(out, self.gyro_matrix, [gyro[i] - self.gyro_bias[i] for i in range(3)])
        return out

    def scales(self):
        """Return g per count of each accelerometer axis (3), including slope, and deg/s per count of the gyro."""
        return self._scale, self._gyro_scale

    def in_vehicle(self):
        """Return calibration and alignment together, as matrices and offsets for raw counts.

        Four lists: matrix (9) and offset (3) of force = matrix * counts + offset, in g; the same for the rate, in
        deg/s. The lists combine Nicolae's equations (18)-(20), accel_matrix and gyro_matrix, and equation (15). A
        reading then takes 18 multiplications."""
        of_force, of_rate = matrix(), matrix()
        product(of_force, self.vehicle_from_sensor, self.accel_matrix)
        product(of_rate, self.vehicle_from_sensor, self.gyro_matrix)
        force_offset, rate_offset = [0.0] * 3, [0.0] * 3
        rotate(force_offset, of_force, self.accel_offset)
        rotate(rate_offset, of_rate, [-bias for bias in self.gyro_bias])
        force = [of_force[i] * self._scale[i % 3] for i in range(9)]
        return force, force_offset, [value * self._gyro_scale for value in of_rate], rate_offset

    def apply(self, reading, force, rate):
        """Fill force (3, g) and rate (3, deg/s), both in the sensor's axes, from a reading (7, the chip's order:
        accelerometer, temperature, gyro)."""
        scale, offset, bias, gyro_scale = self._scale, self.accel_offset, self.gyro_bias, self._gyro_scale
        force[0] = scale[0] * reading[0] + offset[0]
        force[1] = scale[1] * reading[1] + offset[1]
        force[2] = scale[2] * reading[2] + offset[2]
        rate[0] = gyro_scale * reading[4] - bias[0]
        rate[1] = gyro_scale * reading[5] - bias[1]
        rate[2] = gyro_scale * reading[6] - bias[2]
        if self.whole:
            rotate(force, self.accel_matrix, force)
            rotate(rate, self.gyro_matrix, rate)


def six_position_calibration(offset, slope, gyro_bias, matrices=None):
    """Return a new Calibration with the result of the six positions: offset (3, g), slope (3), gyro_bias (3, deg/s).
    matrices: the 27 numbers of Calibration.matrices(), if the gyro was measured too.

    It is not aligned, because the sensor was not on the vehicle for the six poses.
    """
    new = Calibration()
    new.set_accel(offset, slope)
    new.six_done = True
    new.gyro_bias = vector(*gyro_bias)
    if matrices:
        new.set_matrices(matrices)
    return new
