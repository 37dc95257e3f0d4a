"""Calibrates a sensor's readings, and rotates them to other axes."""

from . import Array


def calibrated(accel_g: Array, gyro_dps: Array, offset_g: Array, slope: Array, bias_dps: Array) -> tuple[Array, Array]:
    """Specific force (n, 3, g) and angular rate (n, 3, deg/s), both in the sensor's axes.

    accel_g, gyro_dps (n, 3): readings. offset_g, slope, bias_dps (3). Nicolae's equations (18)-(20): force = slope *
    reading + offset. A gyro's reading is its rate plus its bias.
    """
    return accel_g * slope + offset_g, gyro_dps - bias_dps


def rotated(matrix: Array, *vectors: Array) -> tuple[Array, ...]:
    """Each of vectors (n, 3) along the axes that are the rows of matrix (3, 3), such as vehicle_from_sensor."""
    return tuple(vector @ matrix.T for vector in vectors)
