"""Simulates the poses that a rider captures for a calibration: six sides, a slanted pose, kickstand, upright."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .physics.chip import RATE_HZ, Chip
from .physics.signals import band_noise

POSE_S = 4.0
_ASKEW_DEG = 4.0  # a hand puts the sensor on a side with a tilt up to this angle
_MOVE_DEG = 0.05  # rms of the lean's changes while the rider holds the bike upright


def still(chance: np.random.Generator, chip: Chip, up: NDArray, temp_c: float) -> NDArray[np.float64]:
    """Simulate the readings of a sensor at rest.

    up: The vertical as a unit vector in the sensor's axes, shape (3), or one per row, shape (n, 3).
    temp_c: Temperature of the sensor.
    """
    n = int(POSE_S * RATE_HZ)
    force = np.broadcast_to(up, (n, 3))
    return chip.read(chance, force, np.zeros((n, 3)), np.full(n, temp_c))


def seven(chance: np.random.Generator, chip: Chip, temp_c: float) -> list[NDArray[np.float64]]:
    """Simulate the readings of the seven poses of ups(), a list with an array per pose."""
    return [still(chance, chip, up, temp_c) for up in ups(chance)]


def ups(chance: np.random.Generator) -> Iterator[NDArray[np.float64]]:
    """Yield the vertical in each of seven poses, as a unit vector in the sensor's axes, shape (3).

    The first six poses have each side up once, in random order and tilted by up to 4 degrees. The seventh is slanted.
    """
    for side in chance.permutation(6):
        up = chance.standard_normal(3)
        axis = np.zeros(3)
        axis[side // 2] = 1.0 if side % 2 == 0 else -1.0
        off = up - axis * (up @ axis)
        askew = np.radians(chance.uniform(0.0, _ASKEW_DEG))
        yield axis * np.cos(askew) + off / np.linalg.norm(off) * np.sin(askew)
    signs = chance.choice((-1.0, 1.0), 3)
    free = signs * chance.uniform(0.45, 0.75, 3)
    yield free / np.linalg.norm(free)


def up_seen(lean_deg: float | NDArray, pitch_deg: float) -> NDArray[np.float64]:
    """Return the vertical as a unit vector along the bike's left, up and forward.

    lean_deg: positive to the right. pitch_deg: positive if the nose is up.
    """
    lean, pitch = np.radians(lean_deg), np.radians(pitch_deg)
    left, up = np.sin(lean) * np.cos(pitch), np.cos(lean) * np.cos(pitch)
    return np.stack((left, up, np.full_like(np.asarray(left, dtype=float), np.sin(pitch))), axis=-1)


def standing(
    chance: np.random.Generator,
    chip: Chip,
    vehicle_from_sensor: NDArray,
    lean_deg: float,
    pitch_deg: float,
    temp_c: float,
    held: bool,
) -> NDArray[np.float64]:
    """Simulate the readings of a bike at rest.

    held: True if a rider holds the bike. The lean then changes a little, because no rider stands quite still.
    """
    n = int(POSE_S * RATE_HZ)
    lean = np.full(n, lean_deg)
    if held:
        lean = lean + _MOVE_DEG * band_noise(chance, n, 0.2, 0.6, RATE_HZ)
    return still(chance, chip, up_seen(lean, pitch_deg) @ vehicle_from_sensor, temp_c)
