"""Road roughness through tyres and suspension.

The road is a random profile of ISO 8608: its slope is white noise in distance, so the same road shakes more
at speed, and the rear wheel meets what the front met. Each end is a quarter of a car: wheel on tyre, chassis
on spring.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bike import Bike
from .signals import Signal, band_noise, smoothed, through

CLASS_A, CLASS_B, CLASS_C = 16e-6, 64e-6, 256e-6  # m3, displacement PSD at 0.1 cycles/m (ISO 8608, table)
_STEP_M = 0.02
_CONTACT_M = 0.10  # a tyre does not follow what is shorter than its contact

# One end of a motorcycle with half its rider: kg, kg, N/m, Ns/m, N/m
_SPRUNG, _UNSPRUNG, _SPRING, _DAMPER, _TYRE = 120.0, 15.0, 17e3, 1100.0, 150e3
_LATERAL = 0.35  # of the vertical shaking, along left and forward
_RATE_DPS = np.array(
    [0.0, 8.0, 14.0]
)  # about left (that is pitch, done exactly), up, forward; per m/s2 / 9.8


@dataclass
class Shaking:
    """heave: of the rear end, m/s2; pitch: rad; on top of that force (n, 3) m/s2 and rates (n, 3) rad/s."""

    heave: Signal
    pitch: Signal
    force: NDArray[np.float64]
    rates: NDArray[np.float64]


def transmitted(f: Signal) -> NDArray:
    """Chassis displacement over road displacement of a quarter car, complex, at f in Hz."""
    w = 2.0 * np.pi * f
    strut = _SPRING + 1j * w * _DAMPER
    return _TYRE * strut / ((strut - _SPRUNG * w * w) * (strut + _TYRE - _UNSPRUNG * w * w) - strut * strut)


def profile_slope(chance: np.random.Generator, length_m: float, roughness: float) -> Signal:
    """dz/ds every _STEP_M of a road of this ISO 8608 figure (m3)."""
    density = (2.0 * np.pi * 0.1) ** 2 * roughness
    white = chance.standard_normal(int(length_m / _STEP_M) + 200) * np.sqrt(density / (2.0 * _STEP_M))
    taps = round(_CONTACT_M / _STEP_M)
    return np.convolve(white, np.full(taps, 1.0 / taps), mode="same")


def add_bumps(slope: Signal, places_m: list[float], height_m: float, length_m: float) -> None:
    """Add humps (1 - cos) to a profile's slope in place: speed bumps, patches, braking bumps."""
    n = int(length_m / _STEP_M)
    shape = np.pi * height_m / length_m * np.sin(2.0 * np.pi * np.arange(n) / n)
    for place in places_m:
        first = int(place / _STEP_M)
        if first + n < len(slope):
            slope[first : first + n] += shape


def shaking(
    chance: np.random.Generator, distance: Signal, speed: Signal, slope: Signal, bike: Bike, rate_hz: float
) -> Shaking:
    """What the road does to the chassis of a bike that is at distance (of the rear wheel) at each sample."""
    height = np.cumsum(slope) * _STEP_M
    at = np.arange(len(slope)) * _STEP_M
    front = distance + bike.wheelbase

    def lifted(f: Signal) -> NDArray:
        return 2j * np.pi * f * transmitted(f)

    heave = through(speed * np.interp(distance, at, slope), lifted, rate_hz)
    difference = np.interp(front, at, height) - np.interp(distance, at, height)
    pitch = through(difference / bike.wheelbase, transmitted, rate_hz)
    n = len(distance)
    size = np.sqrt(smoothed(heave * heave, 0.5, rate_hz).clip(0.0))
    force = np.zeros((n, 3))
    for axis in (0, 2):
        force[:, axis] = _LATERAL * size * band_noise(chance, n, 3.0, 25.0, rate_hz)
    rates = np.zeros((n, 3))
    for axis in (1, 2):
        rates[:, axis] = np.radians(_RATE_DPS[axis]) * size / 9.8 * band_noise(chance, n, 4.0, 20.0, rate_hz)
    return Shaking(heave, pitch, force, rates)
