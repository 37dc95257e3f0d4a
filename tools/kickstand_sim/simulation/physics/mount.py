"""Simulates imperfect mounts and loggers with random properties in a realistic range.

The holder resonates, the logger aliases or clips readings, or the sensor warms up.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .chip import Chip
from .signals import Signal, derivative, through

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
        """Compute the motion of the sensor in its holder from force and rates of the bike, shape (n, 3) each, in g and
        deg/s.
        """
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

    chip: Chip  # the sensor
    holder: Holder | None = None  # the soft holder. None for a firm mount.
    rise_c: float | None = None  # replaces Conditions.rise_c, unless None


def holder(chance: np.random.Generator, chip: Chip) -> Mount:
    """Return a holder that resonates at 5 to 40 Hz with a damping of 0.02 to 0.1.

    A holder that resonates at 10 Hz sags by about 0.2 degrees per g. A softer holder sags more.
    """
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
