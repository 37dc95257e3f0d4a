"""Simulates the readings of an MPU6050 with factory errors, mounted at any angle, during a motion.

This is plain Python for CPython and MicroPython. Random numbers depend only on the seed and the time, not on earlier
readings. So CPython and MicroPython get the same reading at the same time.

    world = Sensor(seed=3).world(ride.motion)
    world(20.0)         # (fx, fy, fz, wx, wy, wz, temp_c) in g, deg/s and C, with errors, in the sensor's axes
"""

from math import atan2, cos, degrees, pi, sin, sqrt

# Tolerances, data sheet PS-MPU-6000A rev 3.4, sections 6.1 and 6.2
MAX_OFFSET_G = (0.05, 0.05, 0.08)  # offset of the accelerometer along x, y, z
MAX_SCALE_ERROR = 0.03  # scale error of accelerometer and gyro
MAX_GYRO_BIAS_DPS = 20.0
ACCEL_NOISE_G = 0.0033  # rms noise after the low-pass of 44 Hz, from 400 ug/sqrt(Hz)
GYRO_NOISE_DPS = 0.041  # rms noise after the low-pass of 42 Hz, from 0.005 deg/s/sqrt(Hz)

UNTURNED = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_NOISE_STEP_S = 0.0001  # the noise is constant during this time


def scrambled(number):
    """Return a 32-bit hash of an integer. This module has no other source of random numbers."""
    number = (number ^ (number >> 16)) & 0xFFFFFFFF
    number = (number * 0x45D9F3B) & 0xFFFFFFFF
    number ^= number >> 16
    number = (number * 0x45D9F3B) & 0xFFFFFFFF
    return number ^ (number >> 16)


def normal(number):
    """Compute a nearly normal number with the mean 0 and the rms 1 from the four bytes of a hash."""
    total = (number & 255) + (number >> 8 & 255) + (number >> 16 & 255) + (number >> 24)
    return (total - 510) / 147.8


class Chance:
    def __init__(self, seed):
        self._seed = scrambled(seed + 1)
        self._count = 0

    def uniform(self, low, high):
        self._count += 1
        return low + (high - low) * scrambled(self._seed + self._count) / 0xFFFFFFFF


def random_mounting(seed):
    """Return a random rotation from sensor to vehicle axes, as 9 numbers in the rows left, up, forward.

    Every rotation is equally likely (K. Shoemake, 1992).
    """
    chance = Chance(seed)
    u = chance.uniform(0.0, 1.0)
    a, b = chance.uniform(0.0, 2.0 * pi), chance.uniform(0.0, 2.0 * pi)
    x, y = sqrt(1.0 - u) * sin(a), sqrt(1.0 - u) * cos(a)
    z, w = sqrt(u) * sin(b), sqrt(u) * cos(b)
    return (
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    )  # fmt: skip


class Sensor:
    """The errors and the mounting of one sensor.

    A reading of the accelerometer is scale * true + offset + noise. A reading of the gyro is scale * true + bias +
    noise. Without a seed the only error is noise, and the sensor's axes are the vehicle's.

    seed: Seed of the errors and of the mounting, or None.
    mounting: Rotation from sensor to vehicle axes, as in random_mounting(). None for the default.
    share: Factor on the data sheet's limits of offsets, scale errors and biases.
    noise: Factor on the data sheet's noise.
    """

    def __init__(self, seed=None, mounting=None, share=1.0, noise=1.0):
        self.vehicle_from_sensor = mounting or (UNTURNED if seed is None else random_mounting(seed))
        self.accel_offset_g = (0.0, 0.0, 0.0)
        self.accel_scale = (1.0, 1.0, 1.0)
        self.gyro_bias_dps = (0.0, 0.0, 0.0)
        self.gyro_scale = (1.0, 1.0, 1.0)
        self.accel_noise_g = noise * ACCEL_NOISE_G
        self.gyro_noise_dps = noise * GYRO_NOISE_DPS
        self.temp_c = 25.0
        self._seed = scrambled(7 if seed is None else seed)
        if seed is not None:
            chance = Chance(seed + 1000)
            self.accel_offset_g = tuple([share * chance.uniform(-m, m) for m in MAX_OFFSET_G])
            error = share * MAX_SCALE_ERROR
            self.accel_scale = tuple([1.0 + chance.uniform(-error, error) for _ in range(3)])
            bias = share * MAX_GYRO_BIAS_DPS
            self.gyro_bias_dps = tuple([chance.uniform(-bias, bias) for _ in range(3)])
            self.gyro_scale = tuple([1.0 + chance.uniform(-error, error) for _ in range(3)])

    def read(self, motion, t_s):
        """Return the seven numbers of world() at t_s. motion: what a perfect sensor measures, see Ride.motion()."""
        m = self.vehicle_from_sensor
        left, up, forward, w_left, w_up, w_forward = motion
        instant = self._seed + int(t_s / _NOISE_STEP_S + 0.5) * 6
        values = []
        for i in range(3):  # the transposed matrix rotates from vehicle to sensor axes
            true = m[i] * left + m[3 + i] * up + m[6 + i] * forward
            noise = self.accel_noise_g * normal(scrambled(instant + i))
            values.append(self.accel_scale[i] * true + self.accel_offset_g[i] + noise)
        for i in range(3):
            true = m[i] * w_left + m[3 + i] * w_up + m[6 + i] * w_forward
            noise = self.gyro_noise_dps * normal(scrambled(instant + 3 + i))
            values.append(self.gyro_scale[i] * true + self.gyro_bias_dps[i] + noise)
        values.append(self.temp_c)
        return tuple(values)

    def world(self, motion):
        """Return the function world(t_s) for the simulated board. motion: function of t_s, such as Ride.motion."""
        return lambda t_s: self.read(motion(t_s), t_s)


def resting(sensor, up):
    """Return the function world(t_s) of a sensor at rest. up: vertical vector of any length, in the sensor's axes."""
    size = _length(up)
    motion = tuple([value / size for value in _to_vehicle(sensor, up)] + [0.0, 0.0, 0.0])
    return sensor.world(lambda t_s: motion)


def glide(start, end, u, seconds):
    """Return the value of a smooth change from start to end, and its derivative per second.

    u: share of the change's duration that has passed, 0 to 1. seconds: the duration.
    """
    change = end - start
    if change == 0.0:
        return start, 0.0
    value = start + change * u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return value, change * 30.0 * u * u * (1.0 - u) * (1.0 - u) / seconds


def turning(sensor, first, last, begin_s, end_s):
    """Return the function world(t_s) of a sensor that a hand turns by the shortest way, slowly at both ends.

    first, last: vertical vectors of any length in the sensor's axes, before and after the turn.
    """
    first, last = _unit(first), _unit(last)
    axis = _cross(first, last)
    angle = atan2(_length(axis), _dot(first, last))
    if _length(axis) < 1e-6:  # for a half turn, all perpendicular axes are equally good, so use any of them
        axis = [first[1] - first[2], first[2] - first[0], first[0] - first[1]]
        if _dot(axis, axis) < 0.1:
            axis = [first[1], -first[0], 0.0]
    axis = _unit(axis)
    across = _cross(axis, first)

    def motion(t_s):
        """Return the force in g and the rate in deg/s along left, up and forward, as Ride.motion() does."""
        share = min(1.0, max(0.0, (t_s - begin_s) / (end_s - begin_s)))
        angle_now, radians_per_s = glide(0.0, angle, share, end_s - begin_s)
        up = [cos(angle_now) * first[i] + sin(angle_now) * across[i] for i in range(3)]
        # Negative, because `up` seems to turn in the direction opposite to the sensor's rotation
        rate_dps = [-degrees(radians_per_s) * axis[i] for i in range(3)]
        return tuple(_to_vehicle(sensor, up) + _to_vehicle(sensor, rate_dps))

    return sensor.world(motion)


def _to_vehicle(sensor, vector):
    """Turn a vector from the sensor's axes to left, up, forward."""
    matrix = sensor.vehicle_from_sensor
    return [_dot(matrix[3 * i : 3 * i + 3], vector) for i in range(3)]


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _length(vector):
    return sqrt(_dot(vector, vector))


def _unit(vector):
    size = _length(vector)
    return [value / size for value in vector]
