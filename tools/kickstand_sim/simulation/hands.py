"""Simulates the poses of a calibration: single poses, and a recording in which a hand turns the sensor to each side."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from kickstand_tools.signals import rotation_matrix
from numpy.typing import NDArray

from .physics.chip import RATE_HZ, Chip
from .physics.signals import band_noise, smoothstep

POSE_S = 4.0
_ASKEW_DEG = 4.0  # a hand puts the sensor on a side with a tilt up to this angle
_MOVE_DEG = 0.05  # rms of the lean's changes while the rider holds the bike upright


def still(chance: np.random.Generator, chip: Chip, up: NDArray, temp_c: float) -> NDArray[np.float64]:
    """Simulate the readings of a sensor at rest. up: the vertical in its axes, shape (3) or (n, 3)."""
    n = int(POSE_S * RATE_HZ)
    force = np.broadcast_to(up, (n, 3))
    return chip.read(chance, force, np.zeros((n, 3)), np.full(n, temp_c))


def seven(chance: np.random.Generator, chip: Chip, temp_c: float) -> list[NDArray[np.float64]]:
    return [still(chance, chip, up, temp_c) for up in ups(chance)]


def ups(chance: np.random.Generator) -> Iterator[NDArray[np.float64]]:
    """Yield the vertical in each of seven poses, as a unit vector in the sensor's axes, shape (3).

    The first six poses have each side up once, in random order and tilted a little. The seventh is slanted.
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
    """Return the vertical as a unit vector along the bike's left, up and forward. pitch_deg: > 0 with the nose up."""
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
    """Simulate the readings of a bike at rest. held: True if a rider holds the bike, who does not stand quite still."""
    n = int(POSE_S * RATE_HZ)
    lean = np.full(n, lean_deg)
    if held:
        lean = lean + _MOVE_DEG * band_noise(chance, n, 0.2, 0.6, RATE_HZ)
    return still(chance, chip, up_seen(lean, pitch_deg) @ vehicle_from_sensor, temp_c)


@dataclass(frozen=True)
class Hand:
    still_s: tuple[float, float] = (4.5, 6.0)  # range (shortest, longest) of the time for holding still
    # Range (shortest, longest) of the time for a turn by 90 degrees. A half turn takes 1.5 times as long.
    turn_s: tuple[float, float] = (0.9, 2.0)
    heading_deg: float = 60.0  # largest rotation about the vertical during a turn
    detour_deg: float = 15.0  # deviation from the shortest rotation
    push_g: float = 0.1  # acceleration during a turn, rms


def procedure(
    chance: np.random.Generator, chip: Chip, ups: NDArray[np.float64], temp_c: float, hand: Hand | None = None
) -> NDArray[np.float64]:
    """Simulate one recording of still poses and the turns between them, in the form of Chip.read(), shape (n, 7).

    ups: the vertical in each pose, as unit vectors in the sensor's axes, shape (poses, 3).
    """
    hand = hand or Hand()
    attitude = _turn_between(ups[0], np.array([0.0, 0.0, 1.0]))  # rotation from sensor to world axes, with z up
    forces, rates = [], []

    def hold() -> None:
        n = int(chance.uniform(*hand.still_s) * RATE_HZ)
        forces.append(np.tile(attitude[2], (n, 1)))
        rates.append(np.zeros((n, 3)))

    hold()
    for first, second in pairwise(ups):
        heading = np.radians(chance.uniform(-hand.heading_deg, hand.heading_deg))
        next_attitude = rotation_matrix(np.array([0.0, 0.0, heading])) @ attitude @ _turn_between(second, first)
        rotation = _rotation_vector(next_attitude @ attitude.T)
        turned = np.linalg.norm(rotation)
        n = max(2, int(chance.uniform(*hand.turn_s) * (0.25 + 0.75 * turned / (np.pi / 2)) ** 0.7 * RATE_HZ))
        u = np.arange(n + 1) / n
        # The turn starts and ends slowly, like the movement of a hand
        detour = np.radians(hand.detour_deg) * chance.standard_normal(3) / np.sqrt(3.0)
        share = smoothstep(u)
        stray = np.sin(np.pi * share) ** 2
        path = rotation_matrix(share[:, None] * rotation) @ rotation_matrix(stray[:, None] * detour) @ attitude
        # The rotation between two samples in the sensor's axes. It is small, so its vector is half of `spin`
        steps = np.einsum("nji,njk->nik", path[:-1], path[1:])
        skew = steps - np.swapaxes(steps, 1, 2)
        spin = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1)
        rates.append(np.degrees(0.5 * spin * RATE_HZ))
        push = np.stack([band_noise(chance, n, 0.5, 4.0, RATE_HZ) for _ in range(3)], axis=1)
        forces.append(path[:-1, 2] + hand.push_g * (np.sin(np.pi * u[:-1]) ** 2)[:, None] * push)
        attitude = path[-1]
        hold()
    force = np.concatenate(forces)
    return chip.read(chance, force, np.concatenate(rates), np.full(len(force), temp_c))


def _turn_between(a: NDArray, b: NDArray) -> NDArray:
    axis = np.cross(a, b)
    size = np.linalg.norm(axis)
    if size < 1e-9:
        axis = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        size = np.linalg.norm(axis)
        return rotation_matrix((np.pi if a @ b < 0.0 else 0.0) * axis / size)
    return rotation_matrix(np.arctan2(size, a @ b) * axis / size)


def _rotation_vector(m: NDArray) -> NDArray:
    """Convert a rotation matrix to a rotation vector in rad, by its quaternion, also for a turn by 180 degrees."""
    symmetric = [
        [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
    ]
    _, vectors = np.linalg.eigh(np.array(symmetric))
    q = vectors[:, -1] * (1.0 if vectors[3, -1] >= 0.0 else -1.0)
    size = np.linalg.norm(q[:3])
    return q[:3] * (2.0 * np.arctan2(size, q[3]) / size if size > 1e-12 else 2.0)
