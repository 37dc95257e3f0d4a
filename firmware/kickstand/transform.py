"""Counts of the chip to force and rate of the vehicle in one step: calibration and alignment multiplied out.

    force = R (slope * counts / lsb + offset)          Nicolae's (18)-(20), then (15)
    rate  = R (counts / lsb - bias)

Eighteen products a sample instead of twenty-seven; on the board each takes 12 us and 32 bytes of heap.
"""

from math import radians

from .rotation import rotate


class Transform:
    """calibration: a Calibration, as it is now, with its scale set."""

    def __init__(self, calibration):
        # lists: on a board reading an array's element takes heap, reading a list's does not
        self._force, self._rate = [0.0] * 9, [0.0] * 9
        self._force_offset, self._rate_offset = [0.0] * 3, [0.0] * 3
        r = calibration.vehicle_from_sensor
        scale, gyro_scale = calibration.scales()
        for i in range(9):
            self._force[i] = r[i] * scale[i % 3]
            self._rate[i] = r[i] * radians(gyro_scale)
        rotate(self._force_offset, r, calibration.accel_offset)
        rotate(self._rate_offset, r, [-radians(bias) for bias in calibration.gyro_bias])

    def apply(self, reading, force, rate):
        """reading (7, chip's order) -> force (3: left, up, forward in g) and rate (3: about them in rad/s)."""
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
