"""Simulates the readings of an MPU6050 from the motion of its own axes.

The figures are from the data sheet PS-MPU-6000A rev 3.4, sections 6.1 and 6.2. The chip converts at 1 kHz, and filters
with DLPF 3 (44 Hz, delay of 4.9 ms). The host reads every fifth result. Frequencies above 100 Hz that pass the filter
alias.

MOUNTS has imperfect mounts and loggers with random properties in a realistic range.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..scripted.sensor_errors import MAX_GYRO_BIAS_DPS, MAX_OFFSET_G, MAX_SCALE_ERROR
from .signals import Signal, derivative, through

RATE_HZ = 1000
DIVIDER = 5  # 200 Hz
_COUNTS = 32768.0
_GYRO_COUNTS = 32750.0  # counts at the end of a range, from the data sheet's 65.5 counts per deg/s at 500 deg/s
_ACCEL_NOISE_G = 400e-6 * np.sqrt(RATE_HZ / 2)  # rms of a conversion, from 400 ug/sqrt(Hz)
_GYRO_NOISE_DPS = 0.005 * np.sqrt(RATE_HZ / 2)
_CROSS_AXIS = 0.02  # sensitivity of an axis to motion along another axis
GYRO_DPS_PER_G = 0.1  # sensitivity to linear acceleration
CALIBRATED_C = 25.0

# The filter is a Bessel low-pass of second order with -3 dB at 44 Hz. Its delay is the data sheet's 4.9 ms.
_DLPF_NATURAL_HZ, _DLPF_DAMPING = 44.0 * 1.272, 0.866


def _dlpf() -> NDArray[np.float64]:
    w = 2.0 * np.pi * _DLPF_NATURAL_HZ
    ringing = w * np.sqrt(1.0 - _DLPF_DAMPING**2)
    t = np.arange(40) / RATE_HZ
    response = np.exp(-_DLPF_DAMPING * w * t) * np.sin(ringing * t)
    return response / response.sum()


_DLPF = _dlpf()


@dataclass(frozen=True)
class Chip:
    """The errors of one sensor along x, y, z at 25 C, and their changes with temperature."""

    # Readings divided by true forces, shape (3, 3). The diagonal has the scale factors, the other elements are
    # cross-axis sensitivities.
    accel_matrix: NDArray[np.float64]
    accel_offset: NDArray[np.float64]  # Offset, shape (3), in g
    gyro_matrix: NDArray[np.float64]  # the same as accel_matrix for the rates
    gyro_bias: NDArray[np.float64]  # Bias, shape (3), in deg/s
    accel_per_c: NDArray[np.float64]  # change of the offset per C, shape (3), in g
    gyro_per_c: NDArray[np.float64]  # change of the bias per C, shape (3), in deg/s
    gyro_walk: float = 0.004  # random walk of the bias, in deg/s per sqrt(s)
    accel_range_g: float = 8.0  # range of the accelerometer
    gyro_range_dps: float = 500.0  # range of the gyro
    low_pass: bool = True  # False if no filter precedes the sampling

    @staticmethod
    def random(chance: np.random.Generator, share: float = 1.0, drift: float = 1.0) -> "Chip":
        """Return a random sensor.

        share: Factor on the data sheet's tolerances.
        drift: Factor on an ordinary sensor's drift with temperature.

        Offsets and biases are uniformly distributed within the data sheet's limits. Scale and cross-axis sensitivity
        are normally distributed, with the limit at two standard deviations. For a change of temperature of 45 to 60 C,
        the data sheet allows drifts of 35 to 60 mg for the accelerometer and 20 deg/s for the gyro. An ordinary sensor
        has a third of the accelerometer's drift and a fifth of the gyro's drift.
        """

        def near_one() -> NDArray[np.float64]:
            spread = chance.standard_normal((3, 3)).clip(-2.0, 2.0) / 2.0
            return np.eye(3) + share * spread * np.where(np.eye(3) > 0.0, MAX_SCALE_ERROR, _CROSS_AXIS)

        return Chip(
            accel_matrix=near_one(),
            accel_offset=share * chance.uniform(-1.0, 1.0, 3) * MAX_OFFSET_G,
            gyro_matrix=near_one(),
            gyro_bias=share * chance.uniform(-MAX_GYRO_BIAS_DPS, MAX_GYRO_BIAS_DPS, 3),
            accel_per_c=share * drift * chance.uniform(-0.0003, 0.0003, 3),
            gyro_per_c=share * drift * chance.uniform(-0.06, 0.06, 3),
        )

    def read(
        self,
        chance: np.random.Generator,
        force: NDArray[np.float64],
        rates: NDArray[np.float64],
        temp_c: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Simulate the readings of a motion at 1 kHz, every fifth row from the first on.

        force, rates: true values along and about the sensor's axes, shape (n, 3), in g and deg/s.
        Returns the readings at 200 Hz in the chip's order, in g, C and deg/s, shape (n / 5, 7).
        """
        n = len(force)
        warm = (temp_c - CALIBRATED_C)[:, None]
        walk = chance.standard_normal((n, 3))
        np.cumsum(walk, axis=0, out=walk)
        walk *= self.gyro_walk
        walk /= np.sqrt(RATE_HZ)
        values = force @ self.accel_matrix.T
        values += self.accel_offset
        values += warm * self.accel_per_c
        values += _noise(chance, n, _ACCEL_NOISE_G)
        accel = self._sampled(values, self.accel_range_g, _COUNTS / self.accel_range_g)
        values = rates @ self.gyro_matrix.T
        values += self.gyro_bias
        values += warm * self.gyro_per_c
        values += walk
        del walk
        noise = _noise(chance, n, _GYRO_NOISE_DPS)
        noise += GYRO_DPS_PER_G * force
        values += noise
        del noise
        temp = np.round(temp_c[::DIVIDER] * 340.0) / 340.0
        rate = self._sampled(values, self.gyro_range_dps, _GYRO_COUNTS / self.gyro_range_dps)
        return np.column_stack((accel, temp, rate))

    def _sampled(self, values: NDArray[np.float64], limit: float, lsb: float) -> NDArray[np.float64]:
        """Clip values at the range, filter them, take every fifth value, and round it to whole counts."""
        columns = []
        for column in values.T:
            column = np.clip(column, -limit, limit)
            if not self.low_pass:
                columns.append(column[::DIVIDER].copy())
                continue
            led_in = np.concatenate((np.full(len(_DLPF) - 1, column[0]), column))
            columns.append(np.convolve(led_in, _DLPF, mode="valid")[::DIVIDER].copy())
        counts = np.round(np.column_stack(columns) * lsb)
        return np.clip(counts, -32768, 32767) / lsb


def _noise(chance: np.random.Generator, n: int, rms: float) -> NDArray[np.float64]:
    values = chance.standard_normal((n, 3))
    values *= rms
    return values


_SAG_LIMIT = np.radians(3.0)  # largest sag of a holder, because springs are only linear for a small sag


@dataclass(frozen=True)
class Holder:
    """A soft holder. Sensor and holder behave like a mass on springs, along each axis and about each axis."""

    hz: NDArray[np.float64]  # natural frequency along and about left, up and forward, shape (3)
    damping: NDArray[np.float64]  # damping ratio along and about these axes, shape (3)
    # Rotation per g of force, shape (3), in rad per g. A forward force rotates the holder about left. A force to the
    # left rotates it about forward. No force rotates it about up.
    sag: NDArray[np.float64]

    @staticmethod
    def random(chance: np.random.Generator) -> "Holder":
        hz = np.exp(chance.uniform(np.log(5.0), np.log(40.0), 3))
        sag = chance.uniform(0.1, 0.3, 3) * np.array([1.0, 0.0, 1.0]) * (10.0 / hz) ** 2
        return Holder(hz, np.exp(chance.uniform(np.log(0.02), np.log(0.1), 3)), np.radians(sag))

    def shaken(
        self, force: NDArray[np.float64], rates: NDArray[np.float64], rate_hz: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Compute the motion of the sensor from force and rates of the bike, shape (n, 3) each, in g and deg/s."""
        sprung = np.column_stack([self._by_spring(column, k, rate_hz) for k, column in enumerate(force.T)])
        turned = np.zeros_like(sprung)
        turned[:, 0] = (self.sag[0] * sprung[:, 2]).clip(-_SAG_LIMIT, _SAG_LIMIT)
        turned[:, 2] = (-self.sag[2] * sprung[:, 0]).clip(-_SAG_LIMIT, _SAG_LIMIT)
        turning = np.column_stack([derivative(column, rate_hz) for column in turned.T])
        held_rates = np.column_stack([self._by_spring(column, k, rate_hz) for k, column in enumerate(rates.T)])
        return sprung - np.cross(turned, sprung), held_rates + np.degrees(turning)

    def _by_spring(self, x: Signal, axis: int, rate_hz: float) -> Signal:
        """Return the motion of a mass on a spring whose base moves by x."""

        def transfer(f: Signal) -> NDArray:
            damped = 2j * self.damping[axis] * f / self.hz[axis]
            return (1.0 + damped) / (1.0 + damped - (f / self.hz[axis]) ** 2)

        return through(x, transfer, rate_hz)


@dataclass(frozen=True)
class Mount:
    """The sensor, its mount, and the logger that reads it."""

    chip: Chip
    holder: Holder | None = None  # None for a firm mount
    rise_c: float | None = None  # replaces Conditions.rise_c, unless None


def holder(chance: np.random.Generator, chip: Chip) -> Mount:
    """Return a holder that resonates at 5 to 40 Hz. If it resonates at 10 Hz, it sags by about 0.2 degrees per g."""
    return Mount(chip, Holder.random(chance))


def aliasing(chance: np.random.Generator, chip: Chip) -> Mount:
    """Return a logger without a low-pass before the sampling. Engine vibration then appears at other frequencies."""
    return Mount(replace(chip, low_pass=False))


def clipping(chance: np.random.Generator, chip: Chip) -> Mount:
    """Return a logger with ranges of 2 g and 250 deg/s. Bumps and the engine exceed these ranges."""
    return Mount(replace(chip, accel_range_g=2.0, gyro_range_dps=250.0))


def warming(chance: np.random.Generator, chip: Chip) -> Mount:
    """Return a sensor that warms up by 15 to 25 C. Its accelerometer's offset drifts by up to 1.5 mg per C."""
    drift = chance.uniform(-0.0015, 0.0015, 3)
    return Mount(replace(chip, accel_per_c=drift), rise_c=chance.uniform(15.0, 25.0))


MOUNTS: dict[str, Callable[[np.random.Generator, Chip], Mount]] = {
    mount.__name__: mount for mount in (holder, aliasing, clipping, warming)
}
